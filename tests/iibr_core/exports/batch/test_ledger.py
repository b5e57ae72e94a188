"""What is finished, told to the next run; and keys that change with all that an export is made of."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from iibr_core.exports.batch import ledger
from iibr_core.exports.batch.archive import ArchivePhoto
from iibr_core.exports.batch.ledger import FAILURES, MANIFEST, MOST_LINE_BYTES, Ledger, require_batch_place
from iibr_core.exports.batch.task import BatchSettings, Outcome, PhotoTask, Place, key_of
from iibr_core.rendering.gloss.gloss_settings import Gloss
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError

SETTINGS = BatchSettings("disparity", Source(""))


def finish(opened: Ledger, name: str, key: str) -> None:
    output = opened.folder / name
    output.touch()
    task = PhotoTask(f"/photos/{name}", Place(str(opened.folder), name), key, SETTINGS)
    opened.add_finished(task, Outcome(str(output)))


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


DAMAGE = {
    "torn": b'{"name": "b.pfm", "out',
    "one byte": b"{",
    "no text": b"\xff\xff",
    "no entries": b'[]\n7\n"a"\nnull\n',
    "zeros": b"\0" * 100,
    "deep": b"[" * 100_000,
    "deep and ended": b'{"a":' * 100_000 + b"\n",
    "huge": b'{"name": "a.pfm", "output": "a.pfm", "key": "' + b"9" * 2 * MOST_LINE_BYTES + b'"}\n',
    "huge and torn": b"x" * MOST_LINE_BYTES,
    "huge with an entry at its end": b" " * MOST_LINE_BYTES + b'{"name": "a.pfm", "output": "z", "key": "9"}\n',
    "a huge number": b'{"name": ' + b"9" * 5000 + b"}\n",
}


@pytest.mark.parametrize("left", DAMAGE.values(), ids=DAMAGE.keys())
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


@pytest.mark.parametrize(("left", "ended"), [(b"", b""), (b"[]\n", b"[]\n"), (b"[]", b"[]\n"), (b"\n[", b"\n[\n")])
def test_only_a_torn_last_line_is_ended(tmp_path: Path, left: bytes, ended: bytes) -> None:
    for before, after in ((left, ended), (b"first line\n" + left, b"first line\n" + ended)):
        (tmp_path / MANIFEST).write_bytes(before)
        with Ledger(tmp_path):
            pass
        assert (tmp_path / MANIFEST).read_bytes() == after


def test_the_longest_line_that_a_batch_writes_is_read(tmp_path: Path) -> None:
    name = "\udcff" * 4096  # six bytes each
    place, photo = Place(str(tmp_path), name), "/" + name
    line = PhotoTask(photo, place, "k" * 64, SETTINGS).line(str(tmp_path / name), photo=photo, key="k" * 64)
    (tmp_path / MANIFEST).write_bytes(line)
    with Ledger(tmp_path) as ledger:
        assert ledger.place_of(name).own_output == name


@pytest.mark.parametrize("name", [MANIFEST, FAILURES])
@pytest.mark.parametrize("make", ["symbolic link", "link to nothing", "hard link", "pipe", "folder"])
def test_what_is_no_file_of_its_own_is_refused_and_not_written(tmp_path: Path, name: str, make: str) -> None:
    out, photo = tmp_path / "out", tmp_path / "photo.png"
    out.mkdir()
    photo.write_bytes(b"pixels")
    path = out / name
    if make == "symbolic link":
        path.symlink_to(photo)
    elif make == "link to nothing":
        path.symlink_to(tmp_path / "new")
    elif make == "hard link":
        path.hardlink_to(photo)
    elif make == "pipe":
        os.mkfifo(path)
    else:
        path.mkdir()
    for may_replace in (False, True):
        with pytest.raises(InputError, match=name):
            Ledger(out, may_replace)
    assert photo.read_bytes() == b"pixels"
    assert not (tmp_path / "new").exists()


def test_a_claim_of_what_is_finished_changes_nothing(tmp_path: Path) -> None:
    """As when a run is interrupted between the manifest's line and the end of the claim."""
    with Ledger(tmp_path) as ledger:
        finish(ledger, "a.pfm", "1")
    for key, is_finished in (("1", True), ("2", False)):
        task = PhotoTask("/photos/a.pfm", Place(str(tmp_path), "a.pfm"), key, SETTINGS)
        task.place.claim.write_bytes(task.line(str(tmp_path / "a.pfm"), key=key))
        with Ledger(tmp_path) as ledger:
            assert ledger.has("a.pfm", "1") == is_finished
            assert not ledger.has("a.pfm", "2")
            assert ledger.place_of("a.pfm").own_output == "a.pfm"


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


def test_where_the_system_has_no_locks_a_ledger_opens_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ledger, "fcntl", None)
    with Ledger(tmp_path):
        assert (tmp_path / MANIFEST).is_file()
