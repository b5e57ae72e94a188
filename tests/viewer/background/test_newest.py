"""The newest request wins, errors become one line, and a full queue never holds a cancelled request."""

import threading

import pytest

from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import InputError
from viewer.background.newest import MAX_WAITING_RESULTS, Newest

DEADLINE_S = 60.0


class Desk:
    """Runs functions as requests and waits for their results."""

    def __init__(self):
        self._woken = threading.Semaphore(0)
        self.thread = Newest("test", lambda work, post: work(post), self._woken.release)

    def next(self):
        while (result := self.thread.next_result()) is None:
            assert self._woken.acquire(timeout=DEADLINE_S), "no result"
        return result


@pytest.fixture
def desk():
    desk = Desk()
    yield desk
    desk.thread.close()


def test_results_come_in_order(desk):
    desk.thread.submit(lambda post: [post(i) for i in range(3 * MAX_WAITING_RESULTS)] and None)
    assert [desk.next() for _ in range(3 * MAX_WAITING_RESULTS)] == list(range(3 * MAX_WAITING_RESULTS))


def test_the_newest_request_stops_the_one_before_it(desk):
    is_running = threading.Event()

    def run_for_ever(post):
        is_running.set()
        while True:
            raise_if_stopped()

    desk.thread.submit(run_for_ever)
    assert is_running.wait(DEADLINE_S)
    desk.thread.submit(lambda post: post(2))
    assert desk.next() == 2


def test_a_cancelled_request_does_not_wait_for_room(desk):
    desk.thread.submit(lambda post: [post(1) for _ in range(MAX_WAITING_RESULTS + 1)] and None)
    desk.thread.submit(lambda post: post(2))
    assert desk.next() == 2


@pytest.mark.parametrize(
    ("error", "message"),
    [(InputError("a.png: no\nsuch file"), "a.png: no such file"), (KeyError("x"), "KeyError: 'x'")],
)
def test_an_error_is_one_line_and_the_thread_lives(desk, error, message):
    def fail(post):
        raise error

    desk.thread.submit(fail)
    failed = desk.next()
    assert failed.message == message
    desk.thread.submit(lambda post: post(1))
    assert desk.next() == 1
