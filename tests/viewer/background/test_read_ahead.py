"""Photos read before they are asked for: in which order, what gives way to what, what is forgotten."""

import threading

import pytest

from iibr_core.runtime.work import raise_if_stopped
from iibr_core.scenes.scene import Source, WantedPhoto
from iibr_core.types import InputError
from viewer.background.read_ahead import ReadAhead

DEADLINE_S = 60.0


def photo(name, depth_strength=1.0):
    return WantedPhoto(Source(name), depth_strength)


A, B, C, BAD = (photo(name) for name in ("a", "b", "c", "bad"))


class Shelf:
    """Reads names. begun: in this order; a photo that is `held` is not finished before it is let go."""

    def __init__(self):
        self._woken, self._may_go_on = threading.Semaphore(0), threading.Event()
        self.begun = []
        self.held = ""
        self.ahead = ReadAhead("test", self._woken.release, self._read)

    def _read(self, wanted):
        name = wanted.source.path
        self.begun.append(name)
        self._woken.release()
        if name == "bad":
            raise InputError("bad: no photo")
        if name == self.held:
            assert self._may_go_on.wait(DEADLINE_S)
            raise_if_stopped()
        return f"{name} {wanted.depth_strength:g}"

    def let_go(self):
        self.held = ""
        self._may_go_on.set()

    def want_until_done(self, *wanted):
        self.ahead.want(wanted)
        while not all(map(self.ahead.is_done, wanted)):
            assert self._woken.acquire(timeout=DEADLINE_S), "the reader went silent"
            self.ahead.want(wanted)

    def want_until_begun(self, name, *wanted):
        self.ahead.want(wanted)
        while name not in self.begun:
            assert self._woken.acquire(timeout=DEADLINE_S), "the reader went silent"
            self.ahead.want(wanted)


@pytest.fixture
def shelf():
    made = Shelf()
    yield made
    made.let_go()
    made.ahead.close()


def test_photos_are_read_in_their_order_and_once_and_forgotten_when_wanted_no_more(shelf):
    shelf.want_until_done(B, BAD, A)
    shelf.want_until_done(A, B, C, BAD)
    assert shelf.begun == ["b", "bad", "a", "c"]
    assert shelf.ahead.get(BAD) is None
    assert [shelf.ahead.get(wanted) for wanted in (A, B, C)] == ["a 1", "b 1", "c 1"]
    shelf.ahead.want([C])
    assert [shelf.ahead.get(wanted) for wanted in (A, B, C)] == [None, None, "c 1"]
    assert not shelf.ahead.is_done(A)
    shelf.ahead.keep(A, "read elsewhere")
    shelf.ahead.want([C, A])
    assert shelf.ahead.get(A) == "read elsewhere"


@pytest.mark.parametrize("wanted", [(B, A), (B,)], ids=["first", "alone"])
def test_what_is_wanted_first_does_not_wait_for_another(shelf, wanted):
    shelf.held = "a"
    shelf.want_until_begun("a", A)
    shelf.ahead.want(wanted)
    assert shelf.ahead.is_reading(B)
    shelf.let_go()
    shelf.want_until_done(*wanted)
    assert shelf.begun == ["a", "b", *("a" for photo in wanted if photo is A)]


def test_what_is_being_read_goes_on_while_the_first_is_there(shelf):
    shelf.want_until_done(A)
    shelf.held = "b"
    shelf.want_until_begun("b", A, B)
    shelf.ahead.want([A, C, B])
    assert shelf.ahead.is_reading(B)
    shelf.let_go()
    shelf.want_until_done(A, C, B)
    assert shelf.begun == ["a", "b", "c"]
