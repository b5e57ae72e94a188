"""A hand on the page: pointers, wheels, keys, the bar, and a device that is tilted."""

import json
import re

import pytest

from tests.browsers.chromium import Tab
from tests.viewer.conftest import HEIGHT, WIDTH
from tests.web.conftest import slide, slide_aperture, wait_until_still

FOCUS = "document.getElementById('focus').valueAsNumber"
LENS = f"[{FOCUS}, document.getElementById('aperture').valueAsNumber]"
OPACITY = "+getComputedStyle(document.getElementById('bar')).opacity"
NEAR, FAR = (240, 320), (20, 180)
"""Places on the square and on the wall, in the window of `shown`."""
LEFT, RIGHT, MIDDLE = "left", "right", "middle"


@pytest.fixture
def shown(tab, page) -> Tab:
    """Return an open page, whose picture lies above the bar."""
    tab.resize(480, 640)
    tab.open(page.as_uri())
    wait_until_still(tab)
    return tab


def click(tab: Tab, place: tuple[int, int], button: str = LEFT, at_s: float = 1e9) -> None:
    for kind in ("mousePressed", "mouseReleased"):
        x, y = place
        tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=1, timestamp=at_s)


def touch(tab: Tab, kind: str, *places: tuple[int, int]) -> None:
    points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
    tab.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)


@pytest.mark.parametrize("button", [RIGHT, MIDDLE])
def test_other_buttons_change_nothing(shown, button) -> None:
    lens = shown.evaluate(LENS)
    click(shown, NEAR, button)
    assert shown.evaluate(LENS) == lens
    click(shown, NEAR)
    assert shown.evaluate(LENS) != lens


def test_only_taps_at_one_place_reset(shown) -> None:
    first = shown.evaluate(LENS)
    click(shown, FAR, at_s=1e9)
    click(shown, NEAR, at_s=1e9 + 0.1)
    near = shown.evaluate(LENS)
    assert near > first
    click(shown, FAR, at_s=1e9 + 0.2)
    assert shown.evaluate(LENS) < near
    click(shown, FAR, at_s=1e9 + 0.3)
    assert shown.evaluate(LENS) == first


def test_small_steps_of_a_wheel_add_up_to_a_notch(shown) -> None:
    def change(delta: float, mode: int, times: int = 1) -> float:
        shown.press("r")
        before = shown.evaluate(FOCUS)
        event = f"new WheelEvent('wheel', {{ deltaY: {delta}, deltaMode: {mode}, cancelable: true }})"
        shown.evaluate(f"for (let i = 0; i < {times}; i++) document.getElementById('view').dispatchEvent({event})")
        return before - shown.evaluate(FOCUS)

    notch = change(100, 0)
    assert notch > 0
    assert change(4, 0, 25) == pytest.approx(notch)
    assert change(3, 1) == pytest.approx(notch, rel=0.05), "lines, as Firefox counts them"
    assert change(-100, 0) == pytest.approx(-notch)


def test_a_wheel_over_a_frame_without_focus_scrolls_the_page_around_it(tab, page, site) -> None:
    site.pages["/page.html"] = page.read_bytes()
    site.pages["/frame.html"] = b'<iframe src="/page.html" width=400 height=300></iframe><p style="height: 5000px">'
    tab.resize(480, 640)
    tab.open(f"http://127.0.0.1:{site.server_port}/frame.html")
    tab.wait_until("frames[0].document.documentElement.dataset.state === 'still'")
    tab.call("Input.dispatchMouseEvent", type="mouseWheel", x=200, y=150, deltaX=0, deltaY=120)
    tab.wait_until("scrollY > 0")


def test_sliders_speak_words(shown) -> None:
    def words() -> dict[str, str]:
        return shown.evaluate(
            "Object.fromEntries([...document.querySelectorAll('[type=range]')]"
            ".map(slider => [slider.labels[0].firstElementChild.textContent, slider.getAttribute('aria-valuetext')]))"
        )

    assert words()["Aperture"] == "closed, everything is sharp"
    slide_aperture(shown, 1.5)
    slide(shown, "focus", 0.25)
    assert re.fullmatch(r"≈ f/\d\.\d", words()["Aperture"])
    assert words()["Aperture"] == shown.evaluate("document.getElementById('stop').value")
    assert (words()["Focus range"], words()["Highlights"]) == ("none", "0 %")
    assert words()["Focus"].endswith("% of the way from far to near, disparity 0.25 pixels")


@pytest.mark.parametrize(("width", "height"), [(390, 844), (320, 568), (780, 390), (844, 390), (1200, 800)])
def test_the_bar_is_a_row_of_targets_that_a_finger_hits(tab, page, width, height) -> None:
    tab.resize(width, height, is_phone=width < 1000)
    tab.open(page.as_uri())
    wait_until_still(tab)
    tab.evaluate("for (const name of ['tilt', 'headset']) document.getElementById(name).hidden = false")
    code = """[...document.querySelectorAll('#bar, #bar input, #bar button')].map(one => one.getBoundingClientRect())
        .filter(({ width }) => width).map(({ left, top, width, height }) => [left, top, width, height])"""
    (_, _, _, row), *targets = tab.evaluate(code)
    assert row < 60
    for left, top, across, down in targets:
        assert min(across, down) >= 44
        assert left >= 0
        assert left + across <= width
        assert top + down <= height
    if width < 760:
        tab.evaluate("document.getElementById('more').click()")
        assert len(tab.evaluate(code)) == len(targets) + 7, "lens, tilt, reset, save, full screen, headset"
        slide(tab, "focus", 0.3)
        tab.evaluate("document.querySelector('[data-do=reset]').click()")
        assert len(tab.evaluate(code)) == len(targets) + 1
        assert tab.evaluate(FOCUS) != 0.3


def test_an_invisible_bar_takes_no_taps_and_a_tap_or_a_key_brings_it_back(tab, page) -> None:
    tab.resize(WIDTH * 8, HEIGHT * 8, is_phone=True)  # the bar lies over the picture
    tab.open(page.as_uri())
    wait_until_still(tab)
    tab.wait_until(f"{OPACITY} === 0")
    x, y = tab.evaluate(
        "(({ x, y, width, height }) => [x + width / 2, y + height / 2])"
        "(document.querySelector('[data-do=reset]').getBoundingClientRect())"
    )
    assert tab.evaluate(f"document.elementFromPoint({x}, {y}).id") == "view"
    touch(tab, "touchStart", (x, y))
    touch(tab, "touchEnd")
    tab.wait_until(f"{OPACITY} === 1")
    assert tab.evaluate(LENS)[1] > 0, "the picture below it is focused, and Reset is not pressed"
    tab.evaluate("document.getElementById('bar').classList.add('away')")
    tab.wait_until(f"{OPACITY} === 0")
    tab.call("Input.dispatchKeyEvent", type="keyDown", key="Tab", windowsVirtualKeyCode=9)
    tab.wait_until(f"{OPACITY} === 1")


def test_there_is_no_button_for_a_full_screen_that_cannot_be(tab, page) -> None:
    script = "Object.defineProperty(Document.prototype, 'fullscreenEnabled', { value: undefined })"
    for wanted in (False, True):
        tab.open(page.as_uri())
        wait_until_still(tab)
        assert tab.evaluate("document.getElementById('full').hidden") == wanted
        tab.call("Page.addScriptToEvaluateOnNewDocument", source=script)


def test_a_finger_left_of_a_pinch_does_not_move_the_viewpoint(tab, page) -> None:
    tab.resize(390, 844, is_phone=True)
    tab.open(page.as_uri())
    wait_until_still(tab)
    touch(tab, "touchStart", (180, 420), (200, 420))
    touch(tab, "touchMove", (120, 420), (260, 420))
    touch(tab, "touchEnd", (120, 420))
    wait_until_still(tab)
    before = tab.evaluate("document.getElementById('view').toDataURL()")
    touch(tab, "touchMove", (60, 420))
    touch(tab, "touchEnd")
    wait_until_still(tab)
    assert tab.evaluate("document.getElementById('view').toDataURL()") == before


def test_tilting_moves_the_viewpoint_rests_in_noise_and_stops(shown) -> None:
    def tilt(**angles: float) -> str:
        event = f"new DeviceOrientationEvent('deviceorientation', {json.dumps({'alpha': 0, **angles})})"
        shown.evaluate(f"dispatchEvent({event})")
        wait_until_still(shown)
        return shown.evaluate("document.getElementById('view').toDataURL()")

    def toggle() -> str:
        shown.evaluate("document.getElementById('tilt').click()")
        return shown.evaluate("document.getElementById('tilt').getAttribute('aria-pressed')")

    assert [toggle() for _ in range(3)] == ["true", "false", "true"]
    shown.evaluate("new Promise(done => setTimeout(done))")  # the permission is asked for
    first = tilt(beta=40, gamma=0)
    assert tilt(beta=40.2, gamma=-0.3) == tilt(beta=39.8, gamma=0.2) == first
    assert tilt(beta=40, gamma=10) != first
    shown.evaluate("dispatchEvent(new DeviceOrientationEvent('deviceorientation', { beta: 40.1, gamma: 9.7 }))")
    assert shown.evaluate("document.documentElement.dataset.state") == "still"
    assert toggle() == "false"
    shown.press("r")
    wait_until_still(shown)
    assert tilt(beta=60, gamma=0) == first


SLOW_LENS = """
const { fenceSync, drawArrays, getSyncParameter } = WebGL2RenderingContext.prototype, ends = new WeakMap();
let blocks = 0;
window.passes = [];
Object.assign(WebGL2RenderingContext.prototype, {
    drawArrays(mode, ...rest) { blocks += mode === this.POINTS; return drawArrays.call(this, mode, ...rest); },
    fenceSync(...rest) {
        const sync = fenceSync.call(this, ...rest);
        ends.set(sync, performance.now() + (blocks ? 450 : 0));
        window.passes.push(blocks);
        blocks = 0;
        return sync;
    },
    getSyncParameter(sync, name) {
        return performance.now() < ends.get(sync) ? this.UNSIGNALED : getSyncParameter.call(this, sync, name);
    },
});
"""
"""A graphics card that takes 450 ms for each part of a picture through an open lens, however small it is."""
MOVING = """
passes.length = 0;
window.moves = true;
const move = () => {
    document.getElementById("focus").dispatchEvent(new Event("input"));
    if (window.moves) requestAnimationFrame(move);
};
move();
"""


def test_a_lens_that_is_too_slow_closes_while_the_hand_moves(tab, page) -> None:
    tab.resize(480, 640)
    tab.call("Page.addScriptToEvaluateOnNewDocument", source=SLOW_LENS)
    tab.open(page.as_uri())
    wait_until_still(tab)
    slide_aperture(tab, 1.5)
    wait_until_still(tab)
    tab.evaluate(MOVING)
    tab.wait_until("passes.at(-1) === 0")
    tab.evaluate("passes.length = 0, moves = false")
    wait_until_still(tab)
    assert tab.evaluate("passes.some(Boolean)"), "the lens opens again"
