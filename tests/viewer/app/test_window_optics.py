"""The lens in a real window: viewpoint, clicks, tilt handles, racks, presets and undo; and what each edit costs."""

from iibr_core.beyond.optics import ApertureShape
from iibr_core.gloss.settings import Gloss
from iibr_core.types import ViewOffset
from viewer.model import lens, messages, preferences
from viewer.model.action import do
from viewer.model.messages import Notice


def test_pad_loop_and_double_click_move_the_viewpoint(viewer, monkeypatch):
    app = viewer.app
    # a busy machine may draw for longer than the usual 0.3 s between the two clicks
    monkeypatch.setattr("viewer.ui.host.DOUBLE_CLICK_S", 60.0)
    x, y = viewer.find("pad")
    for (across, down), end in (((-200, -200), ViewOffset(-1, -1)), ((200, 200), ViewOffset(1, 1))):
        viewer.drag((x, y), (x + across, y + down), until=lambda app, end=end: app.state.optics.eye == end)
    assert len(app.state.history.past) == 2
    viewer.press("Circle")
    drawn = app.scene_view.pictures_drawn
    viewer.until(lambda app: app.scene_view.pictures_drawn >= drawn + 5)
    viewer.key("space", settle=lambda app: app.state.motion.is_paused)
    drawn, eye = app.scene_view.pictures_drawn, app.state.optics.eye
    app.step()
    assert (app.scene_view.pictures_drawn, app.state.optics.eye) == (drawn, eye), "nothing moves in a pause"
    viewer.press("Circle", until=lambda app: app.state.motion.kind is None)
    kept = app.state.optics
    viewer.send("mousemove", *viewer.position(0.1, 0.1), "click", "--repeat", 2, "--delay", 40, 1)
    viewer.settle(lambda app: app.state.optics.eye == ViewOffset(0, 0))
    assert app.state.optics.focus_disparity == kept.focus_disparity, "the first click is taken back"


DRAWS = (
    do(lens.set_dolly, 0.5),
    do(lens.set_focus_range, 0.3),
    do(lens.set_focus_tilt, (0.2, 0.1)),
    do(lens.set_aperture_shape, ApertureShape("polygon", blades=5)),
    do(lens.set_highlights, 0.5),
    do(lens.move_eye, ViewOffset(0.5, 0.5)),
    do(lens.set_gloss, Gloss()),
    do(lens.apply_preset, "portrait"),
)
ONLY_PANELS = (
    do(lens.show_tilt_handles, True),
    do(messages.notify, Notice("hello")),
    do(messages.show_prompt, "help"),
    do(preferences.set_theme, "light"),
)


def test_what_each_edit_rebuilds(viewer):
    """Optics draw the picture and nothing else; panels draw panels; only depth strength makes the views again."""
    app = viewer.app

    def cost_of(action):
        before = app.scene_view.pictures_drawn, app.frames_shown, app.scene_view.generation
        app.do(action)
        viewer.settle(lambda app: app.scene_view.gloss_request(app.state.optics.gloss) is None)
        after = app.scene_view.pictures_drawn, app.frames_shown, app.scene_view.generation
        return tuple(a != b for a, b in zip(before, after))

    for action in DRAWS:
        assert cost_of(action) == (True, True, False), action
    assert cost_of(DRAWS[-1]) == (False, False, False), "the same again"
    for action in (*ONLY_PANELS, do(lens.set_depth_strength, 2.0, is_finished=False)):
        assert cost_of(action) == (False, True, False), action
    assert cost_of(do(lens.set_depth_strength, 2.0, is_finished=True)) == (True, True, True)
