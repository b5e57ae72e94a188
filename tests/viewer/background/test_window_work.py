"""Work that other threads hand to the window's: in steps, what is urgent first, nothing for those who left."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from iibr_core.runtime.work import Cancelled, in_this_job, never, stoppable
from iibr_core.types import InputError
from viewer.background.window_work import WindowWork


class Desk:
    """A window's thread, and others that ask it."""

    def __init__(self):
        self.asked = threading.Semaphore(0)
        self.work = WindowWork(self.asked.release)
        self.pool = ThreadPoolExecutor(4)

    def ask(self, steps, should_stop=never, is_urgent=False):
        """Hand it over; it waits there when this returns."""
        with stoppable(should_stop):
            future = self.pool.submit(in_this_job(self.work.run), steps, is_urgent)
        assert self.asked.acquire(timeout=60)
        return future


@pytest.fixture
def desk():
    desk = Desk()
    yield desk
    desk.pool.shutdown()


def counting(name, taken, count=2):
    try:
        for _ in range(count):
            taken.append(name)
            yield
        return name
    finally:
        taken.append(f"end of {name}")


def test_what_is_urgent_comes_first_and_results_go_to_who_asked(desk):
    taken = []
    later, urgent = desk.ask(counting("later", taken)), desk.ask(counting("urgent", taken), is_urgent=True)
    desk.work.advance(0.0)
    assert taken == ["urgent"], "a step at least, and no more than there is time for"
    desk.work.advance(60.0)
    assert (urgent.result(60), later.result(60)) == ("urgent", "later")
    assert taken == ["urgent", "urgent", "end of urgent", "later", "later", "end of later"]
    assert not desk.work.is_waiting


def test_steps_that_fail_fail_where_they_were_asked_for(desk):
    def failing():
        yield
        raise InputError("no room on the graphics card")

    failed, other = desk.ask(failing()), desk.ask(counting("other", []))
    desk.work.advance(60.0)
    with pytest.raises(InputError, match="no room"):
        failed.result(60)
    assert other.result(60) == "other"


def test_steps_that_nobody_waits_for_are_ended(desk):
    taken = []
    given_up = threading.Event()
    future = desk.ask(counting("a", taken, count=9), given_up.is_set)
    desk.work.advance(0.0)
    given_up.set()
    with pytest.raises(Cancelled):
        future.result(60)
    desk.work.advance(60.0)
    assert taken == ["a", "end of a"]
    assert not desk.work.is_waiting
