"""A real window that follows poses from a socket: paths, noise, hostile packets, floods, and what people see."""

import socket
import struct
import subprocess
import sys

import pytest

from iibr_core.types import CENTRE
from viewer.background import tracker
from viewer.model import tracking
from viewer.model.action import do

FLOOD = """
import socket, struct, sys
sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
packets = [struct.pack("<6d", -x / 10, 0, 0, 0, 0, 0) for x in range(-50, 51)]
while True:
    for packet in packets:
        sender.sendto(packet, ("127.0.0.1", int(sys.argv[1])))
"""
"""Program that sends as many poses as it can."""


@pytest.fixture
def port():
    """A port of the loopback address that is free."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        free = probe.getsockname()[1]
        return free


@pytest.fixture
def following(viewer, port):
    viewer.app.do(do(tracking.switch, f"udp:{port}"))
    viewer.app.step()
    return viewer


@pytest.fixture
def send(port):
    """Sends a packet, or the pose of a head so many cm to the right and up."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:

        def send_pose(right=0.0, up=0.0, packet=None):
            pose = struct.pack("<6d", -right, up, 60, 0, 0, 0) if packet is None else packet
            sender.sendto(pose, ("127.0.0.1", port))

        yield send_pose


def head(app):
    """Return the newest place of the head that the window knows."""
    return None if app.state.tracking is None else app.state.tracking.head


def lean(viewer, send, right, up=0.0):
    """Hold the head at a place until the window has followed."""
    goal = complex(right, -up)

    def has_followed(app):
        send(right, up)
        at = head(app)
        return at is not None and abs(at - goal) < 0.1

    viewer.until(has_followed)


def test_a_head_that_goes_right_and_up_moves_near_things_left_and_down(following, send):
    lean(following, send, 0)
    following.until_idle()
    before = following.red_place()
    lean(following, send, 14, 14)
    following.until_idle()
    eye = following.app.state.optics.eye
    assert eye.s > 0.9
    assert eye.t < -0.9
    after = following.red_place()
    assert after[0] < before[0] - 2
    assert after[1] > before[1] + 2
    assert following.app.state.tracking.latency_ms > 0
    assert not following.app.state.history.past


def test_the_window_rests_while_packets_repeat_a_place_and_after_they_stop(following, send):
    lean(following, send, 0)
    lean(following, send, 5)
    following.until_idle()
    drawn, eye = following.app.scene_view.pictures_drawn, following.app.state.optics.eye
    for _ in range(20):
        send(5)
        following.app.step()
    assert following.app.state.optics.eye == pytest.approx(eye, abs=0.02)
    assert following.app.scene_view.pictures_drawn - drawn < 10
    drawn = following.app.scene_view.pictures_drawn
    following.settle(lambda app: app.state.tracking is not None and not app.state.tracking.is_receiving)
    assert following.app.state.optics.eye == pytest.approx(eye, abs=0.02)


def test_a_flood_moves_the_window_and_does_not_fill_it(following, port):
    flood = subprocess.Popen([sys.executable, "-c", FLOOD, str(port)])
    try:
        drawn = following.app.scene_view.pictures_drawn
        following.until(lambda app: app.scene_view.pictures_drawn >= drawn + 30)
        assert following.app.state.optics.eye != CENTRE
    finally:
        flood.kill()
        flood.wait()
    following.until_idle()


def test_a_key_switches_it_on_and_off_at_the_port_that_was_given_last(viewer, port, send):
    app = viewer.app
    app.do(do(tracking.switch, f"udp:{port}"), do(tracking.switch, None))
    viewer.key("h", until=lambda app: app.state.tracking is not None)
    lean(viewer, send, 0)
    lean(viewer, send, 9)
    viewer.until_idle()
    eye = app.state.optics.eye
    viewer.key("h", settle=lambda app: app.state.tracking is None)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", port))
    assert app.state.optics.eye == eye


def test_a_port_in_use_is_an_error_that_names_it(viewer, port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", port))
        viewer.do(do(tracking.switch, f"udp:{port}"), until=lambda app: app.state.tracking is None)
    notice = viewer.app.state.notices[-1]
    assert notice.is_error
    assert notice.text.startswith(f"cannot listen at 127.0.0.1:{port} (")
    assert "--tracker udp:HOST:PORT" in notice.text


def test_a_notice_comes_once_while_no_poses_arrive(viewer, port, monkeypatch):
    monkeypatch.setattr(tracker, "SILENCE_S", 0.0)
    viewer.do(do(tracking.switch, f"udp:{port}"), until=lambda app: bool(app.state.notices))
    assert viewer.app.state.notices[-1].text.startswith(f"No poses at 127.0.0.1:{port}: ")
    viewer.until_idle()
    assert len(viewer.app.state.notices) == 1
