"""The protocol of background work: all wait in a row; errors are told; a lost thread is replaced."""

from __future__ import annotations

import gc
import threading
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from iibr_core.types import InputError
from viewer.background.file_worker import Done, FileRequest, FileWorker
from viewer.background.job_threads import Failed

DEADLINE_S = 60.0


class Desk:
    """A worker of files, and the window's end of it."""

    def __init__(self) -> None:
        self._woken = threading.Semaphore(0)
        self.worker = FileWorker("test", self._woken.release)

    def woken(self) -> bool:
        return self._woken.acquire(timeout=DEADLINE_S)

    def next(self) -> Done | Failed[int]:
        while (result := self.worker.next_result()) is None:
            assert self.woken(), "the worker went silent"
        return result


@pytest.fixture
def desk() -> Iterator[Desk]:
    made = Desk()
    yield made
    made.worker.close()


def test_requests_are_carried_out_in_their_order(desk: Desk) -> None:
    for i in range(20):
        desk.worker.submit(FileRequest(i, lambda i=i: 10 * i))  # type: ignore[misc]
    results = [desk.next() for _ in range(20)]
    assert [(result.id, result.value) for result in results if isinstance(result, Done)] == [
        (i, 10 * i) for i in range(20)
    ]


@pytest.mark.parametrize(
    ("error", "message"),
    [(InputError("a.png: no\nsuch file"), "a.png: no such file"), (KeyError("x"), "KeyError: 'x'")],
)
def test_what_fails_is_told_in_one_line_and_the_next_is_carried_out(desk: Desk, error: Exception, message: str) -> None:
    def fail() -> None:
        raise error

    desk.worker.submit(FileRequest(1, fail))
    desk.worker.submit(FileRequest(2, lambda: "fine"))
    assert desk.next() == Failed(1, message)
    second = desk.next()
    assert isinstance(second, Done)
    assert second.value == "fine"


def test_what_waits_is_given_up_by_cancel(desk: Desk) -> None:
    is_running, may_end, carried_out = threading.Event(), threading.Event(), []

    def hold() -> None:
        is_running.set()
        assert may_end.wait(DEADLINE_S)

    desk.worker.submit(FileRequest(1, hold))
    desk.worker.submit(FileRequest(2, lambda: carried_out.append(2)))
    assert is_running.wait(DEADLINE_S)
    desk.worker.cancel()
    may_end.set()
    desk.worker.submit(FileRequest(3, lambda: carried_out.append(3)))
    assert desk.next().id == 3
    assert carried_out == [3]


def test_closing_carries_out_what_was_asked_for_unless_it_is_cancelled(tmp_path: Path) -> None:
    for cancels, expected in ((False, {"a", "b"}), (True, {"a"})):
        folder = tmp_path / str(cancels)
        folder.mkdir()
        desk, is_running, may_end = Desk(), threading.Event(), threading.Event()

        def hold(folder: Path = folder, is_running: threading.Event = is_running) -> None:
            is_running.set()
            assert may_end.wait(DEADLINE_S)  # noqa: B023
            (folder / "a").touch()

        desk.worker.submit(FileRequest(1, hold))
        desk.worker.submit(FileRequest(2, (folder / "b").touch))
        assert is_running.wait(DEADLINE_S)
        closing = threading.Thread(target=desk.worker.close, args=[cancels])
        if cancels:
            desk.worker.cancel()
        closing.start()
        may_end.set()
        closing.join(DEADLINE_S)
        assert {path.name for path in folder.iterdir()} == expected


def test_a_lost_thread_is_told_and_replaced(desk: Desk, capfd: pytest.CaptureFixture[str]) -> None:
    def die() -> None:
        raise SystemExit("a library tried to end the program")

    desk.worker.submit(FileRequest(1, die))
    assert desk.woken()
    assert desk.worker.is_lost
    assert desk.worker.next_result() is None
    desk.worker.submit(FileRequest(2, lambda: "fine"))
    assert desk.next().id == 2
    assert not desk.worker.is_lost
    assert "a library tried" in capfd.readouterr().err


def test_nothing_of_a_finished_job_is_kept(desk: Desk) -> None:
    """Its inputs may be a picture of a gigabyte."""

    class Large:
        def use(self) -> int:
            return 1

    large = Large()
    kept = weakref.ref(large)
    work: Callable[[], int] | None = large.use
    assert work is not None
    desk.worker.submit(FileRequest(1, work))
    del work, large
    assert desk.next().id == 1
    desk.worker.submit(FileRequest(2, lambda: None))  # the thread is past the first
    assert desk.next().id == 2
    gc.collect()
    assert kept() is None
