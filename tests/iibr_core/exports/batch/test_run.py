"""A batch by an executor of this process: what is made, made again, and never replaced; each worker's part."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from iibr_core.exports.batch.archive import photos_in
from iibr_core.exports.batch.ledger import FAILURES, MANIFEST, Ledger
from iibr_core.exports.batch.run import BatchCount, run_batch, workers_here
from iibr_core.exports.batch.task import CLAIM_PREFIX, BatchSettings
from iibr_core.exports.batch.workers import Workers, WorkerSource
from iibr_core.exports.kinds import ExportKind
from iibr_core.exports.writers import writer_of
from iibr_core.formats.images.photo import write_image
from iibr_core.scenes.scene import Source
from iibr_core.types import InputError, ignore_progress

DEPTH = BatchSettings("depth", Source(""))
DISPARITY, RGBD = replace(DEPTH, kind="disparity"), replace(DEPTH, kind="rgbd")
GIB = 2**30


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    (folder / "sub").mkdir(parents=True)
    for number, name in enumerate(("a.png", "sub/b.png")):
        write_photo(folder / name, number)
    return folder


def write_photo(path: Path, seed: int) -> None:
    write_image(path, np.random.default_rng(seed).integers(0, 255, (24, 32, 3)).astype(np.uint8))


class Lossy(Executor):
    """Does what it is told; nobody hears of it, as when the power goes before the manifest is written."""

    def submit(self, work: Any, /, *arguments: Any, **named: Any) -> Any:
        work(*arguments, **named)
        future: Future[Any] = Future()
        future.set_exception(ConnectionError("gone"))
        return future


def source_of(executor: Executor) -> WorkerSource:
    @contextmanager
    def open_workers() -> Iterator[Workers]:
        yield Workers(executor, lambda: 1, BrokenExecutor)

    return WorkerSource(open_workers, None)


def export(archive: Path, out: Path, settings: BatchSettings = DEPTH, may_replace: bool = False) -> BatchCount:
    with ThreadPoolExecutor(1) as executor, Ledger(out, may_replace) as ledger:
        return run_batch(ledger, settings, photos_in([archive]), source_of(executor), None, ignore_progress)


def failures(out: Path) -> dict[str, str]:
    rows = csv.DictReader((out / FAILURES).read_text().splitlines())
    return {Path(row["photo"]).name: row["reason"] for row in rows}


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_what_is_there_stays_and_what_changed_is_made_anew(archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert export(archive, out) == BatchCount(2, written=2, guessed=2)
    before = files(out)
    assert set(before) == {"a_depth.pfm", "sub/b_depth.pfm", MANIFEST, FAILURES}
    assert export(archive, out) == BatchCount(2, there_before=2, guessed=2)
    assert files(out) == before
    write_photo(archive / "a.png", 7)
    assert export(archive, out) == BatchCount(2, written=1, there_before=1, guessed=2)
    changed = files(out)
    assert changed["a_depth.pfm"] != before["a_depth.pfm"]
    assert changed["sub/b_depth.pfm"] == before["sub/b_depth.pfm"]


def test_guesses_are_counted_also_of_what_was_there_before(archive: Path, tmp_path: Path) -> None:
    """A photo with a map beside it is no guess."""
    np.save(archive / "a_disparity.npy", np.tile(np.arange(32, dtype=np.float32), (24, 1)))
    assert export(archive, tmp_path / "out") == BatchCount(2, written=2, guessed=1)
    assert export(archive, tmp_path / "out") == BatchCount(2, there_before=2, guessed=1)


def test_every_photo_of_a_mixed_folder_is_exported_and_no_map(archive: Path, tmp_path: Path) -> None:
    """Also photos that are named like maps, and those that share a name."""
    for number, name in enumerate(("b.jpg", "b.png", "c.jpg", "shallow_depth.jpg", "c_depth.jpg", "a_disparity.png")):
        Image.fromarray(np.random.default_rng(number).integers(0, 255, (24, 32, 3)).astype(np.uint8)).save(
            archive / name
        )
    Image.fromarray(np.tile(np.arange(0, 256, 8, dtype=np.uint8), (24, 1))).save(archive / "c_depth.jpg")
    Image.fromarray(np.tile(np.arange(0, 256, 8, dtype=np.uint8), (24, 1))).save(archive / "a_disparity.png")
    (archive / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0oops")
    (archive / "notes.txt").write_text("x")
    out = tmp_path / "out"
    assert export(archive, out, RGBD) == BatchCount(7, written=6, failed=1, guessed=4)
    written = {name for name in files(out) if name.endswith(".png")}
    assert written == {"a.png", "b.jpg.png", "b.png.png", "c.png", "shallow_depth.png", "sub/b.png"}
    assert list(failures(out)) == ["broken.jpg"]


def test_another_kind_or_other_settings_replace_nothing_unless_forced(archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    export(archive, out, RGBD)
    before = files(out)
    with pytest.raises(InputError, match=r"a\.png: was exported with --to rgbd;.*--force"):
        export(archive, out, replace(RGBD, kind="epi"))
    with pytest.raises(InputError, match=r"a\.png: was exported with other options;"):
        export(archive, out, replace(RGBD, depth_strength=2.0))
    assert files(out) == before
    assert export(archive, out, replace(RGBD, kind="epi"), may_replace=True) == BatchCount(2, written=2, guessed=2)
    assert files(out)["a.png"] != before["a.png"]


def test_other_memory_is_no_other_setting(archive: Path, tmp_path: Path) -> None:
    export(archive, tmp_path / "out")
    source = replace(DEPTH.source, depth=replace(DEPTH.source.depth, memory_bytes=GIB))
    assert export(archive, tmp_path / "out", replace(DEPTH, source=source)).failed == 0


@pytest.mark.parametrize(("settings", "name"), [(DISPARITY, "a.pfm"), (DEPTH, "a_depth.pfm")])
def test_a_file_that_no_batch_wrote_stays_unless_forced(
    archive: Path, tmp_path: Path, settings: BatchSettings, name: str
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_bytes(b"mine")
    for _ in range(2):
        done = export(archive, out, settings)
        assert done.failed == 1
        assert (out / name).read_bytes() == b"mine"
        assert "already exists" in failures(out)["a.png"]
        assert "--force" in failures(out)["a.png"]
    assert export(archive, out, settings, may_replace=True).written == 1
    assert (out / name).read_bytes().startswith(b"Pf")


@pytest.mark.parametrize("may_replace", [False, True])
@pytest.mark.parametrize("link", ["a_depth.pfm", "sub"])
def test_nothing_is_written_through_links(archive: Path, tmp_path: Path, link: str, may_replace: bool) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    (elsewhere / "b_depth.pfm").write_bytes(b"mine")
    (out / link).symlink_to(elsewhere / "b_depth.pfm" if link.endswith("pfm") else elsewhere)
    before = files(elsewhere)
    done = export(archive, out, may_replace=may_replace)
    assert (done.written, done.failed) == (1, 1)
    assert files(elsewhere) == before
    assert (out / link).is_symlink()


def test_what_was_written_and_not_reported_is_ours_afterwards(archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(InputError, match="workers were lost"), Ledger(out) as ledger:
        run_batch(ledger, DEPTH, photos_in([archive]), source_of(Lossy()), None, ignore_progress)
    assert (out / "a_depth.pfm").is_file()
    assert not list(out.glob(f"{CLAIM_PREFIX}*"))
    assert export(archive, out) == BatchCount(2, written=2, guessed=2)


class Died(BaseException):
    """As a worker that is killed."""


def test_what_a_worker_wrote_that_died_of_it_is_ours_afterwards(
    monkeypatch: pytest.MonkeyPatch, archive: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"

    def write_and_die(kind: ExportKind) -> Callable[..., None]:
        def write(*arguments: Any) -> None:
            writer_of(kind)(*arguments)
            raise Died

        return write

    with monkeypatch.context() as patch, Ledger(out) as ledger:
        patch.setattr("iibr_core.exports.writers.writer_of", write_and_die)
        with pytest.raises(Died):
            run_batch(ledger, DEPTH, photos_in([archive]), source_of(Lossy()), None, ignore_progress)
    assert (out / "a_depth.pfm").is_file()
    assert export(archive, out) == BatchCount(2, written=2, guessed=2)


def test_a_killed_run_leaves_a_claim_that_the_next_one_takes(archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    killed = Ledger(out)
    with pytest.raises(InputError, match="workers were lost"):
        run_batch(killed, DEPTH, photos_in([archive]), source_of(Lossy()), None, ignore_progress)
    killed._manifest.close()  # as the system does
    assert len(list(out.glob(f"{CLAIM_PREFIX}*"))) == 1
    assert export(archive, out) == BatchCount(2, written=2, guessed=2)
    assert not list(out.glob(f"{CLAIM_PREFIX}*"))


@pytest.mark.parametrize(
    ("memory_gib", "asked", "share_gib"),
    [(64, 1, 16.0), (64, 4, 12.8), (8, 1, 2.0), (8, 2, 2.0), (8, 4, 1.6), (8, 8, 0.8), (1, 1, 0.8), (1, 2, 0.4)],
)
def test_workers_share_four_fifths_of_the_memory(
    monkeypatch: pytest.MonkeyPatch, memory_gib: int, asked: int, share_gib: float
) -> None:
    set_machine(monkeypatch, 64, memory_gib)
    assert workers_here(asked).memory_bytes == pytest.approx(share_gib * GIB, abs=1)


@pytest.mark.parametrize(
    ("cores", "memory_gib", "workers"), [(2, 64, 2), (16, 8, 4), (16, 64, 16), (64, 64, 34), (4, 1, 1), (1, 64, 1)]
)
def test_usually_there_is_a_worker_for_each_core_that_has_memory(
    monkeypatch: pytest.MonkeyPatch, cores: int, memory_gib: int, workers: int
) -> None:
    set_machine(monkeypatch, cores, memory_gib)
    assert workers_here().open.args == (workers, max(cores // workers, 1))  # type: ignore[attr-defined]


@pytest.mark.parametrize(("cores", "asked", "threads"), [(8, 2, 4), (8, 3, 2), (2, 8, 1)])
def test_workers_share_the_cores(monkeypatch: pytest.MonkeyPatch, cores: int, asked: int, threads: int) -> None:
    set_machine(monkeypatch, cores, 64)
    assert workers_here(asked).open.args == (asked, threads)  # type: ignore[attr-defined]


def set_machine(monkeypatch: pytest.MonkeyPatch, cores: int, memory_gib: int) -> None:
    """As on a machine of that size."""
    for module in ("iibr_core.runtime.machine", "iibr_core.exports.batch.run"):
        monkeypatch.setattr(f"{module}.core_count", lambda: cores)
        monkeypatch.setattr(f"{module}.memory_bytes", lambda: memory_gib * GIB)
