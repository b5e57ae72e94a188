"""A page in a headset, which the package iwer emulates in Chromium: `make test` installs it."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from iibr_core.beyond.optics import Optics
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.browsers.chromium import Tab
from tests.viewer.conftest import FAR, HEIGHT, NEAR, WIDTH, write_scene
from tests.web.conftest import STILL, canvas, export, slide, wait_until_still
from viewer.display.offscreen import OffscreenScene

IWER = Path(__file__).parent / "node_modules/iwer/build/iwer.min.js"
INSTALL = """;{
const given = IWER.XRReferenceSpace.prototype.getOffsetReferenceSpace;  // iwer 2.5.0 reads a matrix
IWER.XRReferenceSpace.prototype.getOffsetReferenceSpace = function (offset) { return given.call(this, offset.matrix); };
globalThis.headset = new IWER.XRDevice(IWER.metaQuest3, { stereoEnabled: true });
headset.installRuntime({ forceInstall: true });
for (const hand of Object.values(headset.controllers)) hand.connected = false;
}"""
BUTTON = "document.getElementById('headset')"
GRID = GridShape(5, 9)
EYE_PX = 400
START_M = np.array([0.0, 1.6, 0.0])
"""Place of the emulated head at the start."""
DISTANCE_M, SIDE_M, EYES_M, HEAD_M = 1.5, 1.2, 0.063, 0.1
"""Numbers of `web/headset.js`."""
STEP_M = (EYES_M + HEAD_M) / (GRID.columns - 1)
FOCUS, DEPTH_STRENGTH = 0.5, 3.0
MIN_PSNR_DB = 36.0
"""Half a level of compression and half a pixel of resampling; 37.6 dB were measured at least."""
MAX_OFF_PX = 0.7
"""Largest distance of the red square from its true place: 0.47 px were measured at most."""

Matrix = NDArray[np.float64]


class Pose(NamedTuple):
    """A head's place from its start, m, and its turn, from the head's space to the room's."""

    place: Matrix
    turn: Rotation

    def eye(self, side: int) -> Matrix:
        """Place of an eye from the window's middle, m. side: -1 left, 1 right."""
        return np.array([0.0, 0.0, DISTANCE_M]) + self.place + self.turn.apply((side * EYES_M / 2, 0.0, 0.0))

    def pixels(self, points: Matrix, side: int) -> Matrix:
        """Return where an eye sees points (N, 3) of the window's space: (N, 2) in its half of the canvas."""
        x, y, z = self.turn.inv().apply(points - self.eye(side)).T  # a field of 90 degrees
        return EYE_PX / 2 * np.stack([1 - x / z, 1 + y / z], -1)


RANDOM = np.random.default_rng(7).uniform(-1, 1, (6, 2, 3)) * ((0.025, 0.015, 0.04), (0.2, 0.3, 0.15))
POSES = [Pose(np.zeros(3), Rotation.identity()), *(Pose(at, Rotation.from_rotvec(turn)) for at, turn in RANDOM)]


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> Path:
    """The wall's lower left part comes nearer downwards."""
    path = write_scene(tmp_path_factory.mktemp("scene"))
    disparity = np.load(path.with_name("scene_disparity.npy"))
    disparity[HEIGHT // 2 :, : WIDTH // 4] += np.linspace(0, (NEAR - FAR) / 4, HEIGHT // 2, dtype=np.float32)[:, None]
    np.save(path.with_name("scene_disparity.npy"), disparity)
    return path


@pytest.fixture(scope="module")
def page(scene) -> Path:
    return export(scene, "--depth-strength", f"{DEPTH_STRENGTH:g}", grid="5x9")


@pytest.fixture
def worn(tab, page) -> Iterator[Tab]:
    """The page in a headset, focused on FOCUS."""
    assert IWER.is_file(), "make test installs iwer"
    tab.call("Page.addScriptToEvaluateOnNewDocument", source=IWER.read_text("utf-8") + INSTALL)
    tab.resize(2 * EYE_PX, EYE_PX)
    tab.open(page.as_uri())
    wait_until_still(tab)
    slide(tab, "focus", FOCUS)
    wait_until_still(tab)
    tab.evaluate(f"{BUTTON}.click()")
    tab.wait_until("headset.activeSession?.renderState.baseLayer")
    yield tab
    assert tab.complaints == []


def wait_for_frames(tab: Tab, count: int = 2) -> None:
    tab.evaluate(
        f"new Promise(done => {{ let left = {count};"
        " const next = () => (left-- ? requestAnimationFrame(next) : done()); next() })"
    )


def eyes_at(tab: Tab, pose: Pose) -> list[NDArray[np.uint8]]:
    """Return the pictures of both eyes."""
    x, y, z = START_M + pose.place
    tab.evaluate(
        f"headset.position.set({x}, {y}, {z}); headset.quaternion.set({', '.join(map(str, pose.turn.as_quat()))})"
    )
    wait_for_frames(tab)
    return np.split(canvas(tab), 2, axis=1)


def side_m() -> tuple[float, float]:
    """Size of the window, without what is cropped for the focus, m."""
    return tuple(
        SIDE_M * side / WIDTH * (1 - 2 * FOCUS * (views - 1) / 2 / side)
        for side, views in ((WIDTH, GRID.columns), (HEIGHT, GRID.rows))
    )


def desktop_picture(viewer: OffscreenScene, eye: Matrix) -> NDArray[np.uint8]:
    """Return the desktop's picture of what an eye sees through the window.

    The rays through the window's edges cross the cameras' plane at `s`; there they see `x` of the picture.
    """
    axes = []
    for sign, at, shown, side in zip((1, -1), eye, side_m(), (WIDTH, HEIGHT)):
        edges = np.array([-shown / 2, shown / 2])
        s = (edges + (sign * at - edges) * DISTANCE_M / eye[2]) / STEP_M
        x = 0.5 + (edges / SIDE_M * WIDTH - FOCUS * s) / side
        axes.append((s[0] + (0.5 - x[0]) * (s[1] - s[0]) / (x[1] - x[0]), (s[1] - s[0]) / (x[1] - x[0]), x))
    (s, dolly, (left, right)), (t, _, (top, bottom)) = axes
    optics = Optics(eye=ViewOffset(t, s), dolly=-dolly / 2, focus_disparity=FOCUS)
    part = Rect(left, top, right - left, bottom - top)
    return viewer.draw(RenderSettings(optics, ScreenSize(2 * WIDTH, 2 * HEIGHT), part))


def seen_through(picture: NDArray[np.uint8], pose: Pose, side: int) -> NDArray[np.uint8]:
    """Return a picture as an eye sees it in the window."""
    height, width = picture.shape[:2]
    across, down = side_m()
    corners = np.array([(x * across / 2, y * down / 2, 0.0) for y in (1, -1) for x in (-1, 1)])
    source = np.array([(x, y) for y in (0, height) for x in (0, width)])
    places = (np.float32(points - 0.5) for points in (source, pose.pixels(corners, side)))  # from the middle of a pixel
    return cv2.warpPerspective(picture, cv2.getPerspectiveTransform(*places), (EYE_PX, EYE_PX))


def square_m(disparity: float) -> Matrix:
    """Return the corners (4, 3) of the red square, as far before the window as its disparity says."""
    beside = (disparity - FOCUS) * SIDE_M / WIDTH / STEP_M
    depth = beside / (1 + beside) * DISTANCE_M
    places = (
        SIDE_M / WIDTH * np.array([(x * WIDTH / 6, y * HEIGHT / 4) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    )
    return np.column_stack([places * (1 - depth / DISTANCE_M), np.full(4, depth)])


def red_middle(picture: NDArray[np.uint8]) -> Matrix:
    """Return the middle (x, y) of what is red."""
    red, green, _ = np.moveaxis(picture.astype(int), -1, 0)
    y, x = np.nonzero(red - green > 60)
    return np.array([x.mean() + 0.5, y.mean() + 0.5])


def test_seven_poses_show_each_eye_the_desktops_picture_with_true_depth(worn, scene) -> None:
    """The red square is where a thing in the room would be: as far before the window as its disparity says."""
    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(scene), grid=GRID), DEPTH_STRENGTH)
        corners = square_m(viewer.scene.disparity_range_px[1])
        for pose in POSES:
            for side, drawn in zip((-1, 1), eyes_at(worn, pose)):
                wanted = desktop_picture(viewer, pose.eye(side))
                inside = seen_through(np.full_like(wanted, 255), pose, side) == 255
                error = (drawn.astype(float) - seen_through(wanted, pose, side))[inside]
                assert 10 * np.log10(255**2 / np.mean(error**2)) >= MIN_PSNR_DB, (pose, side)
                outline = cv2.moments(np.float32(pose.pixels(corners, side)))
                off_px = red_middle(drawn) - np.array([outline["m10"], outline["m01"]]) / outline["m00"]
                assert np.abs(off_px).max() <= MAX_OFF_PX, (pose, side)


def lens(tab: Tab) -> list[float]:
    """Return focus and aperture."""
    values: list[float] = tab.evaluate("['focus', 'aperture'].map(name => document.getElementById(name).valueAsNumber)")
    return values


def move_hand(tab: Tab, x: float, y: float, trigger: int, hand: str = "right") -> None:
    """Move a hand, which points straight ahead, beside the window's middle, m."""
    tab.evaluate(
        f"(hand => {{ hand.connected = true; hand.position.set({x}, {START_M[1] + y}, 0);"
        f" hand.updateButtonValue('trigger', {trigger}); }})(headset.controllers.{hand})"
    )
    wait_for_frames(tab)


def test_a_hand_focuses_where_it_points_and_opens_the_aperture(worn) -> None:
    """A surface in focus lies in the window's plane: both eyes see it at the same place of the window."""
    found = []
    for place in ((-0.5, 0.3), (-0.5, -0.3), (0.0, 0.0), (2.0, 0.0)):
        move_hand(worn, *place, trigger=1)
        move_hand(worn, *place, trigger=0)
        found.append(lens(worn))
    (far, _), (below, _), (near, aperture), beside = found
    assert near > below > far, "the square lies before the wall, which comes nearer downwards"
    assert beside == [near, aperture], "the hand points beside the window"
    wait_for_frames(worn, 24)
    left, right = eyes_at(worn, POSES[0])
    edge = EYES_M / DISTANCE_M * EYE_PX / 2
    assert red_middle(left)[0] - red_middle(right)[0] == pytest.approx(edge, abs=0.5)
    move_hand(worn, 0.0, 0.0, trigger=1)
    left, _ = eyes_at(worn, POSES[0])
    assert left[EYE_PX // 2, EYE_PX // 2 + round(edge / 2)].min() > 200, "a dot"
    move_hand(worn, -0.3, 0.15, trigger=0, hand="left")
    _, right = eyes_at(worn, POSES[0])
    for place in ((0.0, 0.0, 0.0), (-0.3, 0.15, 0.0)):
        ((x, y),) = np.floor(POSES[0].pixels(np.array([place]), 1)).astype(int)
        assert right[y, x].min() > 200, "a dot for each hand"
        assert right[y - 4 : y + 5, [x - 4, x + 4]].min(axis=-1).max() < 200, "a small one"
    worn.evaluate("headset.controllers.left.connected = false")
    move_hand(worn, 0.0, 0.2, trigger=1)
    opened = lens(worn)
    widest = worn.evaluate("JSON.parse(document.getElementById('field').textContent).apertureLimits[1]")
    assert aperture < opened[1] < aperture + widest / 2, "as far as a fifth of the window's height opens it"
    wait_for_frames(worn, 4)
    assert lens(worn) == pytest.approx(opened, abs=1e-3), "the hand rests"
    worn.evaluate("headset.controllers.right.quaternion.set(0, 1, 0, 0)")  # it points away
    move_hand(worn, 0.0, 0.2, trigger=1)
    move_hand(worn, 0.0, 0.2, trigger=0)
    assert lens(worn) == pytest.approx(opened, abs=1e-3)


def test_the_page_comes_back_where_a_session_ends_or_does_not_begin(worn, page) -> None:
    worn.evaluate(f"{BUTTON}.click()")
    worn.wait_until(STILL)
    after = canvas(worn)
    worn.open(page.as_uri())
    wait_until_still(worn)
    slide(worn, "focus", FOCUS)
    wait_until_still(worn)
    assert (after == canvas(worn)).all()
    worn.evaluate(f"navigator.xr.requestSession = () => Promise.reject(new Error('no head')); {BUTTON}.click()")
    worn.wait_until("document.getElementById('status').textContent.includes('no head')")


def test_without_a_headset_there_is_no_button(tab, page) -> None:
    tab.open(page.as_uri())
    wait_until_still(tab)
    assert tab.evaluate(f"{BUTTON}.hidden")
