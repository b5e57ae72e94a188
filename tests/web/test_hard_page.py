"""Every gesture and control of a page of an uneven, even-numbered field: each leads to the desktop's picture."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from iibr_core.beyond.optics import CENTRE, ApertureShape, Optics
from iibr_core.depth.choice import DepthChoice
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.browsers.chromium import Tab
from tests.viewer.cli.hard_inputs import COLUMNS, HEIGHT, ROW_STEP, ROWS, SQUARE_PX, WALL_PX, WIDTH, write_inputs
from tests.web.conftest import canvas, export, slide, wait_until_still
from tests.web.test_page import psnr
from viewer.display.offscreen import OffscreenScene

SCALE = 6.0
"""CSS pixels for a pixel of the views; the picture is in the middle of a window of this width."""
SHOWN = ScreenSize(432, 640)
TOP = (SHOWN.height - SCALE * HEIGHT) / 2
MIN_DB, MIN_ENLARGED_DB = 37.5, 31.0
"""Agreement with the desktop's coarse picture: 39.4 and 32.0 dB were measured at least."""
MAX_CHANGE_OFF = 0.32
"""Largest error of a change of the picture, as a share of it: 0.2 was measured at most."""
MAX_OFF = 0.06
"""Largest difference of a slider from its number: disparity of a place that is tapped is found from the views."""
CTRL, SHIFT = 2, 8
"""Bits of pressed keys."""
WIDEST, STOPS, FOCUS_STEPS = 7.2, 6, 50
"""Widest aperture of the field, view steps; stops of its slider, steps of its focus."""


def place(x: float, y: float) -> tuple[float, float]:
    """Return the place in the window of a pixel of the photo."""
    return SCALE * (x + 0.5), TOP + SCALE * (y + 0.5)


def wheel(tab: Tab, delta: float, at: tuple[float, float], keys: int = 0) -> None:
    tab.call("Input.dispatchMouseEvent", type="mouseWheel", x=at[0], y=at[1], deltaX=0, deltaY=delta, modifiers=keys)


def press_shifted(tab: Tab, key: str) -> None:
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key=key, modifiers=SHIFT)


def choose(tab: Tab, shape: str) -> None:
    list_of_shapes = "document.getElementById('shape')"
    tab.evaluate(f"{list_of_shapes}.value = '{shape}', {list_of_shapes}.dispatchEvent(new Event('change'))")


DISC = ApertureShape()


@dataclass(frozen=True)
class Lens:
    """The page's lens, as a person has set it."""

    eye: ViewOffset = CENTRE
    focus: float = 0.0
    aperture: float = 0.0
    range: float = 0.0
    highlights: float = 0.0
    shape: ApertureShape = DISC
    part: Rect = WHOLE

    @property
    def stops(self):
        return STOPS + math.log2(self.aperture / WIDEST) if self.aperture else 0.0

    @property
    def optics(self):
        return Optics(
            self.eye, focus_disparity=self.focus, focus_range=self.range, aperture_shape=self.shape,
            aperture_diameter=self.aperture, highlight_recovery=self.highlights,
        )  # fmt: skip


def sets(**values):
    return lambda lens, step: replace(lens, **values)


def focuses(steps):
    return lambda lens, step: replace(lens, focus=lens.focus + steps * step)


def opens(stops):
    return lambda lens, step: replace(lens, aperture=lens.aperture * 2**stops)


NEARER = math.exp(0.2)
GESTURES = {
    "a drag": (
        lambda tab: tab.drag(place(60, 20), place(50, 14), place(48, 11)),
        sets(eye=ViewOffset(9 / HEIGHT * ROWS, 12 / WIDTH * COLUMNS)),
    ),
    "keys of the viewpoint": (lambda tab: tab.press("ArrowUp", 3), sets(eye=ViewOffset(0.0, 0.5))),
    "a key with shift": (lambda tab: press_shifted(tab, "ArrowUp"), sets(eye=ViewOffset(-1.0, 0.5))),
    "keys beyond the first row": (lambda tab: tab.press("ArrowUp", 9), sets(eye=ViewOffset(-2.0, 0.5))),
    "keys back and aside": (
        lambda tab: (tab.press("ArrowDown", 2), tab.press("ArrowLeft", 4)), sets(eye=ViewOffset(-1.5, -0.5))
    ),
    "a tap on the square": (
        lambda tab: tab.drag(place(26 + 0.5 * SQUARE_PX, 28 + 1.5 * ROW_STEP * SQUARE_PX)),
        sets(focus=SQUARE_PX, aperture=WIDEST / 10),
    ),
    "a tap on the wall": (lambda tab: tab.drag(place(8, 20)), sets(focus=WALL_PX + 8 / WIDTH)),
    "a wheel": (lambda tab: wheel(tab, 200, place(10, 10)), focuses(-2)),
    "plus": (lambda tab: tab.press("+", 5), focuses(5)),
    "minus": (lambda tab: tab.press("-"), focuses(-1)),
    "an opening bracket": (lambda tab: tab.press("["), opens(-0.5)),
    "closing brackets": (lambda tab: tab.press("]", 3), opens(1.5)),
    "a slider of the aperture": (lambda tab: slide(tab, "aperture", 4.8), sets(aperture=WIDEST * 2**-1.2)),
    "a ring": (lambda tab: choose(tab, "ring"), sets(shape=ApertureShape("ring"))),
    "a slider of highlights": (lambda tab: slide(tab, "highlights", 0.6), sets(highlights=0.6)),
    "blades": (lambda tab: choose(tab, "polygon 5"), sets(shape=ApertureShape("polygon", blades=5))),
    "a slider of the range": (lambda tab: slide(tab, "range", 0.4), sets(range=0.4)),
    "a cat's eye": (lambda tab: choose(tab, "cat_eye"), sets(shape=ApertureShape("cat_eye"))),
    "page up": (lambda tab: tab.press("PageUp", 2), sets(part=Rect(0.18, 0.18, 0.64, 0.64))),
    "a wheel with ctrl": (
        lambda tab: wheel(tab, -40, place(17.5, 35.5), keys=CTRL),
        sets(part=Rect(0.18 + 0.16 * (1 - 1 / NEARER), 0.18 + 0.48 * (1 - 1 / NEARER), 0.64 / NEARER, 0.64 / NEARER)),
    ),
    "a slider of the focus": (lambda tab: slide(tab, "focus", 2.2), sets(focus=2.2)),
    "page down": (lambda tab: tab.press("PageDown", 4), sets(part=WHOLE)),
    "R with caps lock, on a slider": (
        lambda tab: (tab.evaluate("document.getElementById('focus').focus()"), tab.press("R")), lambda *_: Lens()
    ),
}  # fmt: skip
"""Gestures in turn, with what each changes. step: of the focus."""
READ = "['focus', 'aperture', 'range', 'highlights'].map(name => document.getElementById(name).valueAsNumber)"


@pytest.fixture
def desktop(tmp_path):
    """The desktop's viewer on the field of the page, which lies beside it as `views.html`."""
    write_inputs(tmp_path)
    given = str(tmp_path / "hdr_disparity.pfm")
    export(tmp_path / "views", "--disparity", given, grid=f"{ROWS}x{COLUMNS}")
    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(tmp_path / "views"), DepthChoice(file=given)))
        yield viewer


def test_every_gesture_leads_to_the_desktops_picture(tab, tmp_path, desktop) -> None:
    tab.resize(*SHOWN)
    tab.open((tmp_path / "views.html").as_uri())
    wait_until_still(tab)
    far, near = tab.evaluate("JSON.parse(document.getElementById('field').textContent).focusLimits")
    lens, before = Lens(), (drawn_by(desktop, Lens()), canvas(tab))
    for name, (gesture, set_lens) in GESTURES.items():
        gesture(tab)
        wait_until_still(tab)
        lens = set_lens(lens, (near - far) / FOCUS_STEPS)
        values, expected = tab.evaluate(READ), [lens.focus, lens.stops, lens.range, lens.highlights]
        assert values == pytest.approx(expected, abs=MAX_OFF), name
        lens = replace(lens, focus=values[0])
        wanted, drawn = drawn_by(desktop, lens), canvas(tab)
        assert psnr(coarse(drawn), coarse(wanted)) > (MIN_DB if lens.part == WHOLE else MIN_ENLARGED_DB), name
        change, seen = (coarse(now) - coarse(earlier) for now, earlier in zip((wanted, drawn), before))
        assert rms(seen - change) < 1 + MAX_CHANGE_OFF * rms(change), name
        before = wanted, drawn


def drawn_by(desktop, lens):
    """Return the desktop's picture, as large as the page's."""
    return desktop.draw(RenderSettings(lens.optics, ScreenSize(2 * WIDTH, 2 * HEIGHT), lens.part))


def coarse(pixels):
    """Return means of 4 x 4 pixels: depth edges of compressed views lie a pixel beside."""
    height, width, _ = pixels.shape
    return pixels.reshape(height // 4, 4, width // 4, 4, 3).mean(axis=(1, 3))


def rms(difference):
    return float(np.sqrt(np.mean(difference**2)))
