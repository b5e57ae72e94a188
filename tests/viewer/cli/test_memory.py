"""`--memory`, limits of the process and settings of saved pictures: refused before anything is allocated, or kept."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iibr_core.formats.images.photo import write_image
from iibr_core.formats.images.settings_text import ATTRIBUTE, settings_text_in
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.model.saved_settings import require_saved_size
from viewer.model.state.saving import SavedSettings

MIB = 2**20
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits and peaks as Linux has them")


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("large") / "large.png"
    noise = np.random.default_rng(0).integers(0, 40, (64, 4000, 3), np.uint8)
    slope = np.linspace(0, 200, 4000).astype(np.uint8)[None, :, None]
    write_image(path, np.tile(noise + slope, (47, 1, 1))[:3000])
    return path


@pytest.fixture(scope="module")
def saved_text(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Settings that lie in a picture of this program."""
    folder = tmp_path_factory.mktemp("saved")
    small, saved = folder / "small.png", folder / "saved.png"
    write_image(small, np.random.default_rng(0).random((30, 40, 3), np.float32))
    assert ended("screenshot", small, "--grid", 1, "-o", saved)[0] == 0
    text: dict[str, Any] = json.loads(settings_text_in(saved))
    return text


MEASURED = """
import json, os, resource, subprocess, sys
limit = int(sys.argv[1])
if limit:
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
done = subprocess.run([sys.executable, "-m", "viewer", *sys.argv[2:]], capture_output=True, text=True)
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
print(json.dumps([done.returncode, peak, done.stderr.splitlines()]))
"""
"""From a small process: the system counts what a process was forked from as its peak."""


def ended(*arguments: object, limit_bytes: int = 0) -> tuple[int, float, list[str]]:
    """Exit code, peak in MiB and lines on stderr of the command in a process of its own."""
    command = [sys.executable, "-S", "-c", MEASURED, str(limit_bytes), *map(str, arguments)]
    code, peak, lines = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return code, peak, lines


@pytest.mark.parametrize("memory", ["600M", "1G"])
def test_the_peak_of_a_fresh_process_stays_within_memory(large: Path, tmp_path: Path, memory: str) -> None:
    allowed = 600 if memory == "600M" else 1024
    for command in (
        ["plan", large, "--max-pixels", 12_000_000],
        ["screenshot", large, "--max-pixels", 12_000_000, "-o", tmp_path / "o.png"],
    ):
        code, peak, _ = ended(*command, "--memory", memory)
        assert code == 0
        assert peak <= 1.1 * allowed, command


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plan", "--memory", "100M"], "takes 3"),
        (["plan", "--grid", "99"], "at most --grid"),
        (["screenshot", "--grid", "31", "--memory", "1G"], "at most --grid"),
        (["generate", "--grid", "3", "--memory", "1G", "--max-pixels", "12000000"], "give --max-pixels"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line_before_it_is_read(
    large: Path, tmp_path: Path, arguments: list[str], words: str
) -> None:
    out = {"generate": ["--out", tmp_path / "out"], "screenshot": ["-o", tmp_path / "out.png"]}.get(arguments[0], [])
    code, peak, lines = ended(arguments[0], large, *arguments[1:], *out)
    assert code == 2
    assert len(lines) == 1, lines
    assert words in lines[0]
    assert peak < 400
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("limit_bytes", [500_000_000, 900_000_000])
@pytest.mark.parametrize("command", ["plan", "generate", "screenshot"])
def test_a_limited_address_space_is_refused_before_opengl_starts(
    large: Path, tmp_path: Path, command: str, limit_bytes: int
) -> None:
    more = {"generate": ["--grid", 3, "--out", tmp_path / "out"], "screenshot": ["-o", tmp_path / "out.png"]}
    code, _, lines = ended(command, large, *more.get(command, []), limit_bytes=limit_bytes)
    assert code == 2
    assert len(lines) == 1, lines
    assert "ulimit -v" in lines[0]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"size_px": [30_000, 30_000]}, "30000x30000"),
        ({"source": {"grid": [99, 99]}}, "99 x 99 views"),
        ({"source": {"memory_bytes": 2**62, "grid": [99, 99]}}, "the budget (--memory) is"),
    ],
)
def test_settings_of_a_picture_ask_for_no_more_than_the_machine_has(
    large: Path, tmp_path: Path, saved_text: dict[str, Any], changed: dict[str, Any], words: str
) -> None:
    saved, source = tmp_path / "saved.png", {**saved_text["source"], "grid": None, **changed.get("source", {})}
    text = json.dumps({**saved_text, **changed, "source": source})
    write_image(saved, np.zeros((8, 8, 3), np.uint8), {ATTRIBUTE: text})
    code, peak, lines = ended("screenshot", large, "--like", saved, "-o", tmp_path / "out.png")
    assert code == 2
    assert len(lines) == 1, lines
    assert words in lines[0]
    assert peak < 400
    assert not (tmp_path / "out.png").exists()


@pytest.mark.parametrize(
    ("size", "is_drawn"),
    [((16_384, 6_000), True), ((16_385, 1), False), ((1, 16_385), False), ((12_000, 12_000), False)],
)
def test_sizes_that_settings_ask_for_have_limits(size: tuple[int, int], is_drawn: bool) -> None:
    saved = SavedSettings(Optics(), 1.0, Source(""), ScreenSize(*size))
    if is_drawn:
        require_saved_size(saved, Path("a.png"))
        return
    with pytest.raises(InputError, match=f"a.png.*{size[0]}x{size[1]}"):
        require_saved_size(saved, Path("a.png"))
