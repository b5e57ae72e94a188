"""Where exports may go: folders are replaced as a whole, so they may hold nothing but an export of before."""

from __future__ import annotations

from pathlib import Path

import pytest

from iibr_core.exports.kinds import EXPORTS, export_kind, require_ending
from iibr_core.exports.source import ExportSource
from iibr_core.exports.writers import require_export_place, writer_of
from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.types import InputError
from tests.iibr_core.exports.conftest import exported

FOLDERS = [name for name, kind in EXPORTS.items() if not kind.endings]


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_of_other_things_is_never_replaced(source: ExportSource, tmp_path: Path, name: str) -> None:
    kind, folder = EXPORTS[name], tmp_path / "out"
    require_export_place(kind, folder, (), False)
    exported(source, name, folder, **({"frames": 1} if "frames" in kind.supports else {}))
    with pytest.raises(AlreadyThereError):
        require_export_place(kind, folder, (), False)
    require_export_place(kind, folder, (), True)
    mine = next(place for place in (folder / "images", folder) if place.is_dir()) / "mine.png"
    mine.touch()
    with pytest.raises(InputError, match=r"mine\.png"):
        require_export_place(kind, folder, (), True)


@pytest.mark.parametrize("name", EXPORTS)
def test_every_kind_has_its_function_and_its_words(name: str) -> None:
    kind = export_kind(name)
    assert callable(writer_of(kind))
    assert kind.words
    assert all(ending == ending.lower() for ending in kind.endings)
    if kind.endings:
        with pytest.raises(InputError, match="must end in"):
            require_ending(kind, Path("a.txt"))
    assert len({other.words for other in EXPORTS.values()}) == len(EXPORTS)


def test_what_nobody_knows_is_refused() -> None:
    with pytest.raises(InputError, match="hologram"):
        export_kind("hologram")
