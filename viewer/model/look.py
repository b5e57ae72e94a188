"""The look of a picture, to be copied to other photos: aperture, light, tone of the depth, and depth strength."""

from __future__ import annotations

from dataclasses import dataclass, replace

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.scenes.lens_limits import aperture_limit, clamp_optics, focus_span
from iibr_core.scenes.scene import Scene, Source
from viewer.model import folder
from viewer.model.app_state import AppState
from viewer.model.history import undoable
from viewer.model.messages import Notice, notify


@dataclass(frozen=True)
class Look:
    """A look that was copied. aperture_share: of the widest aperture; range_share: of all depth, for the sharp range.

    tone: clips, gamma and inversion of the depth, without strokes. wanted_for: photo that is being opened to have it.
    """

    optics: Optics
    aperture_share: float
    range_share: float
    tone: DepthEdits
    depth_strength: float
    wanted_for: Source | None = None


COPIED = "Copied the look. Ctrl+Shift+V gives it to another photo."
NO_LOOK = "There is no look to paste. Copy one first (Ctrl+Shift+C)."


def copy_look(state: AppState) -> AppState:
    """Remember the look of the open picture."""
    scene, optics = state.scene, state.optics
    if scene is None:
        return state
    widest, span = aperture_limit(scene) or 1.0, focus_span(scene) or 1.0
    tone = replace(state.depth.edits, strokes=())
    look = Look(optics, optics.aperture_diameter / widest, optics.focus_range / span, tone, state.depth_strength)
    return notify(replace(state, look=look), Notice(COPIED, is_result=True))


def paste_look_to(state: AppState, steps: int) -> AppState:
    """Give the photo `steps` after the open one the look that was copied: open it first, unless it is open."""
    if state.look is None or steps == 0:
        return paste_look(state)
    opened = folder.step(state, steps)
    return opened if opened is state else replace(opened, look=replace(state.look, wanted_for=opened.source))


@undoable
def paste_look(state: AppState, scene: Scene) -> AppState:
    """Give the open picture the look that was copied; viewpoint, focus, gloss and strokes stay its own."""
    look = state.look
    if look is None:
        return notify(state, Notice(NO_LOOK))
    optics = replace(
        state.optics,
        aperture_diameter=look.aperture_share * aperture_limit(scene),
        focus_range=look.range_share * focus_span(scene),
        aperture_shape=look.optics.aperture_shape,
        highlight_recovery=look.optics.highlight_recovery,
        exposure_stops=look.optics.exposure_stops,
    )
    state = replace(state, optics=clamp_optics(optics, scene), has_chosen_aperture=True, shows_before=False)
    state = replace(state, look=replace(look, wanted_for=None))
    depth = replace(state.depth, edits=replace(look.tone, strokes=state.depth.edits.strokes))
    if scene.plan is None or (depth, look.depth_strength) == (state.depth, state.depth_strength):
        return state
    return replace(state, depth=depth, depth_strength=look.depth_strength, generation=state.generation + 1)
