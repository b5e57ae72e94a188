"""What is finished, told to the next run; and keys that change with all that an export is made of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from iibr_core.rendering.gloss.settings import Gloss
from iibr_core.types import GridShape, InputError
from viewer.app.batch.archive import ArchivePhoto
from viewer.app.batch.ledger import FAILURES, MANIFEST, Ledger, require_batch_place
from viewer.app.batch.task import BatchSettings, Outcome, PhotoTask, key_of
from viewer.model.state.scene import Source

SETTINGS = BatchSettings("disparity", Source(""))


def finish(ledger: Ledger, name: str, key: str) -> None:
    output = ledger.folder / name
    output.touch()
    ledger.add_finished(PhotoTask(f"/photos/{name}", str(output), key, SETTINGS), Outcome(str(output)))


def test_what_is_finished_is_known_afterwards(tmp_path: Path) -> None:
    with Ledger(tmp_path / "out") as ledger:
        finish(ledger, "a\udcff.pfm", "1")
        finish(ledger, "b.pfm", "2")
        finish(ledger, "b.pfm", "3")
    (tmp_path / "out" / "c.pfm").touch()
    with Ledger(tmp_path / "out") as ledger:
        assert ledger.has("a\udcff.pfm", "1")
        assert ledger.has("b.pfm", "3")
        assert not ledger.has("b.pfm", "2")
        assert not ledger.has("c.pfm", "3")
        (tmp_path / "out" / "b.pfm").unlink()
        assert not ledger.has("b.pfm", "3")


@pytest.mark.parametrize("left", [b'{"name": "b.pfm", "out', b"\xff\xff", b"[]\n7\n", b"\0" * 100])
def test_what_a_power_cut_leaves_costs_only_its_line(tmp_path: Path, left: bytes) -> None:
    with Ledger(tmp_path) as ledger:
        finish(ledger, "a.pfm", "1")
    with open(tmp_path / MANIFEST, "ab") as file:
        file.write(left)
    with Ledger(tmp_path) as ledger:
        assert ledger.has("a.pfm", "1")
        finish(ledger, "b.pfm", "2")
    with Ledger(tmp_path) as ledger:
        assert ledger.has("a.pfm", "1")
        assert ledger.has("b.pfm", "2")


def test_failures_are_those_of_the_last_run(tmp_path: Path) -> None:
    with Ledger(tmp_path) as ledger:
        ledger.add_failure("/a, \udcff.png", "two\nlines")
    assert (tmp_path / FAILURES).read_bytes() == b'photo,reason\r\n"/a, \xff.png",two lines\r\n'
    with Ledger(tmp_path):
        pass
    assert (tmp_path / FAILURES).read_text().splitlines() == ["photo,reason"]


def test_two_runs_do_not_write_one_folder(tmp_path: Path) -> None:
    with Ledger(tmp_path), pytest.raises(InputError, match="another batch"):
        Ledger(tmp_path)
    with Ledger(tmp_path):
        pass


def test_other_files_stay_unless_forced_and_own_ones_need_no_force(tmp_path: Path) -> None:
    out, photos = tmp_path / "out", tmp_path / "photos"
    photos.mkdir()
    out.mkdir()
    (out / "mine.png").touch()
    with pytest.raises(InputError, match="--force"):
        require_batch_place(out, [photos], may_replace=False)
    require_batch_place(out, [photos], may_replace=True)
    with Ledger(out):
        pass
    require_batch_place(out, [photos], may_replace=False)
    with pytest.raises(InputError, match="read"):
        require_batch_place(photos / "out", [photos], may_replace=True)


def test_a_key_changes_with_photo_map_settings_and_name(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(b"photo")
    photo = ArchivePhoto(str(path), "a")
    keys = [key_of(SETTINGS, photo)]
    assert key_of(replace(SETTINGS, source=Source("")), photo) == keys[0]
    for settings in (
        replace(SETTINGS, kind="depth"),
        replace(SETTINGS, source=Source("", grid=GridShape(3, 3))),
        replace(SETTINGS, depth_strength=2.0),
        replace(SETTINGS, focus=0.0),
        replace(SETTINGS, gloss=Gloss()),
    ):
        keys.append(key_of(settings, photo))
    surroundings = tmp_path / "sky.exr"
    for content in (b"day", b"night"):
        surroundings.write_bytes(content)
        keys.append(key_of(replace(SETTINGS, gloss=Gloss(environment=str(surroundings))), photo))
    keys.append(key_of(SETTINGS, ArchivePhoto(str(path), "sub/a")))
    (tmp_path / "a_disparity.pfm").write_bytes(b"map")
    keys.append(key_of(SETTINGS, photo))
    (tmp_path / "a_disparity.pfm").rename(tmp_path / "a_depth.pfm")
    keys.append(key_of(SETTINGS, photo))
    path.write_bytes(b"photO")
    keys.append(key_of(SETTINGS, photo))
    assert len(set(keys)) == len(keys)


def test_a_key_of_what_cannot_be_read_says_so(tmp_path: Path) -> None:
    (tmp_path / "empty.png").touch()
    for name in ("empty.png", "missing.png"):
        with pytest.raises(InputError, match=name):
            key_of(SETTINGS, ArchivePhoto(str(tmp_path / name), "a"))
