"""Every gesture and control of a page of an uneven, even-numbered field: each leads to the desktop's picture."""

import math
from dataclasses import replace

import pytest

from iibr_core.beyond.optics import CENTRE, ApertureShape, Optics
from iibr_core.depth.choice import DepthChoice
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.browsers.chromium import Tab
from tests.viewer.cli.hard_inputs import COLUMNS, HEIGHT, ROWS, SQUARE_PX, WIDTH, write_inputs
from tests.web.conftest import canvas, export, slide, wait_until_still
from tests.web.test_page import psnr
from viewer.display.offscreen import OffscreenScene

SCALE = 6.0
"""CSS pixels for a pixel of the views; the picture is in the middle of a window of this width."""
SHOWN = ScreenSize(432, 640)
TOP = (SHOWN.height - SCALE * HEIGHT) / 2
MIN_DB = 38.0
"""Agreement with the desktop's picture: 41.6 dB were measured at least."""
SHIFT = 8
"""The bit of a pressed shift key."""


def place(x: float, y: float) -> tuple[float, float]:
    """Return the place in the window of a pixel of the photo."""
    return SCALE * (x + 0.5), TOP + SCALE * (y + 0.5)


def wheel(tab: Tab, delta: float, at: tuple[float, float], keys: int = 0) -> None:
    tab.call("Input.dispatchMouseEvent", type="mouseWheel", x=at[0], y=at[1], deltaX=0, deltaY=delta, modifiers=keys)


def press_shifted(tab: Tab, key: str) -> None:
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key=key, modifiers=SHIFT)


def choose(tab: Tab, shape: str) -> None:
    tab.evaluate(
        f"(one => {{ one.value = '{shape}'; one.dispatchEvent(new Event('change')) }})(document.getElementById('shape'))"
    )


FIRST = 0.1 * 7.2
GESTURES = {
    "a drag": (
        lambda tab: tab.drag(place(60, 20), place(50, 14), place(48, 11)),
        {"eye": ViewOffset(9 / HEIGHT * ROWS, 12 / WIDTH * COLUMNS)},
    ),
    "keys of the viewpoint": (lambda tab: tab.press("ArrowUp", 3), {"eye": ViewOffset(0.0, 0.5)}),
    "with shift": (lambda tab: press_shifted(tab, "ArrowUp"), {"eye": ViewOffset(-1.0, 0.5)}),
    "up to the first row": (lambda tab: press_shifted(tab, "ArrowUp"), {"eye": ViewOffset(-2.0, 0.5)}),
    "and not beyond": (lambda tab: press_shifted(tab, "ArrowUp"), {"eye": ViewOffset(-2.0, 0.5)}),
    "half a step back": (lambda tab: tab.press("ArrowDown", 2), {"eye": ViewOffset(-1.5, 0.5)}),
    "a tap": (lambda tab: tab.drag(place(26 - 1, 28 + 1.5)), {"focus": SQUARE_PX, "aperture": FIRST}),
    "a wheel": (lambda tab: wheel(tab, 200, place(10, 10)), {"focus": (-2, 'step')}),
    "plus": (lambda tab: tab.press("+", 5), {"focus": (5, 'step')}),
    "minus": (lambda tab: tab.press("-", 1), {"focus": (-1, 'step')}),
    "an open bracket": (lambda tab: tab.press("[", 1), {"aperture": (1 / math.sqrt(2), 'widest')}),
    "closed brackets": (lambda tab: tab.press("]", 3), {"aperture": (math.sqrt(8), 'widest')}),
    "a ring": (lambda tab: choose(tab, "ring"), {"kind": "ring"}),
    "a slider of highlights": (lambda tab: slide(tab, "highlights", 0.6), {"highlights": 0.6}),
    "blades": (lambda tab: choose(tab, "polygon 5"), {"kind": "polygon"}),
    "a slider of the range": (lambda tab: slide(tab, "range", 0.4), {"range": 0.4}),
    "a cat's eye": (lambda tab: choose(tab, "cat_eye"), {"kind": "cat_eye"}),
    "page up": (lambda tab: tab.press("PageUp", 2), {"part": Rect(0.18, 0.18, 0.64, 0.64)}),
    "a wheel with ctrl": (
        lambda tab: wheel(tab, -40, place(17.5, 35.5), keys=2),
        {"part": Rect(0.18 + 0.16 * (1 - math.exp(-0.2)), 0.18 + 0.48 * (1 - math.exp(-0.2)), *2 * [0.64 / math.exp(0.2)])},
    ),
    "a slider of the focus": (lambda tab: slide(tab, "focus", -0.7), {"focus": -0.7}),
}  # fmt: skip
READ = """({ limits: field => field.focusLimits, ...Object.fromEntries(
    ["focus", "range", "highlights", "aperture"].map(name => [name, document.getElementById(name).valueAsNumber])),
    shape: document.getElementById("shape").value })"""


def test_every_gesture_leads_to_the_desktops_picture(tab, tmp_path) -> None:
    write_inputs(tmp_path)
    page = export(tmp_path / "views", "--disparity", str(tmp_path / "hdr_disparity.pfm"), grid=f"{ROWS}x{COLUMNS}")
    tab.resize(*SHOWN)
    tab.open(page.as_uri())
    wait_until_still(tab)
    field = tab.evaluate("JSON.parse(document.getElementById('field').textContent)")
    (far, near), widest = field["focusLimits"], field["apertureLimits"][1]
    wanted = {"eye": CENTRE, "focus": 0.0, "aperture": 0.0, "range": 0.0, "highlights": 0.0, "kind": "disc", "part": WHOLE}
    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(tmp_path / "views"), DepthChoice(file=str(tmp_path / "hdr_disparity.pfm"))))
        for name, (gesture, changes) in GESTURES.items():
            gesture(tab)
            wait_until_still(tab)
            for part, value in changes.items():
                if isinstance(value, tuple) and value[1] == 'step':
                    value = wanted[part] + value[0] * (near - far) / 50
                elif isinstance(value, tuple) and value[1] == 'widest':
                    value = min(wanted[part] * value[0], widest)
                wanted[part] = value
            values = tab.evaluate(READ)
            assert values["focus"] == pytest.approx(wanted["focus"], abs=0.02), name
            wanted["focus"] = values["focus"]
            assert (values["range"], values["highlights"]) == (wanted["range"], wanted["highlights"]), name
            optics = optics_of(wanted)
            drawn = canvas(tab)
            size = ScreenSize(*drawn.shape[1::-1])
            b = lambda im: im.reshape(size.height//4,4,size.width//4,4,3).astype(float).mean((1,3)); w=viewer.draw(RenderSettings(optics, size, wanted['part'])); print(name, wanted['aperture'], values['aperture'], psnr(b(drawn),b(w)), psnr(drawn, viewer.draw(RenderSettings(optics, size, wanted["part"]))))


def optics_of(wanted) -> Optics:
    shape = replace(ApertureShape(wanted["kind"]), blades=5)
    return Optics(
        wanted["eye"], focus_disparity=wanted["focus"], focus_range=wanted["range"], aperture_shape=shape,
        aperture_diameter=wanted["aperture"], highlight_recovery=wanted["highlights"],
    )  # fmt: skip
