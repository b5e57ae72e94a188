"""The page about uninstalling states the folders that the program uses, on three systems."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs
import pytest
from platformdirs.macos import MacOS
from platformdirs.unix import Unix
from platformdirs.windows import Windows

from iibr_core.depth.models.cache import cache_folder
from iibr_core.depth.models.catalog import own_models_folder
from iibr_core.runtime import kernels
from viewer.app.clipboard import copied_path
from viewer.app.preferences_store import user_folder
from viewer.app.session_store import SESSIONS_FOLDER
from viewer.entry import log_file

PAGE = Path(__file__).parents[1] / "docs" / "uninstall.md"


@pytest.mark.parametrize(("column", "system"), [("Linux", Unix), ("Windows", Windows), ("macOS |", MacOS)])
def test_the_page_names_every_folder_of_the_user(
    monkeypatch: pytest.MonkeyPatch, column: str, system: type[platformdirs.api.PlatformDirsABC]
) -> None:
    for name in ("CONFIG", "DATA", "CACHE", "STATE"):
        monkeypatch.delenv(f"XDG_{name}_HOME", raising=False)
    monkeypatch.delenv(kernels.FOLDER_VARIABLE, raising=False)
    monkeypatch.setenv("HOME", "/home")
    monkeypatch.setattr("platformdirs.windows.get_win_folder", {"CSIDL_LOCAL_APPDATA": "/local"}.__getitem__)
    monkeypatch.setattr(platformdirs, "PlatformDirs", system)
    monkeypatch.setattr(kernels, "_copy_kernels", lambda folder: None)
    monkeypatch.setattr(os, "access", lambda *_: False)  # as where root installed the program
    used = [
        user_folder(),
        user_folder() / SESSIONS_FOLDER,
        own_models_folder(),
        cache_folder(),
        copied_path().parent,
        kernels.kernel_folder.__wrapped__().parent,
        log_file().parent,
    ]
    table = PAGE.read_text("utf-8").partition("## What stays")[2]
    header, _, *rows = [line.split(" | ") for line in table.splitlines() if line.startswith("| ")]
    stated = [row[header.index(column)].strip("` |").replace("\\", "/") for row in rows]
    assert [path.replace("~", "/home").replace("%LOCALAPPDATA%", "/local") for path in stated] == list(map(str, used))
