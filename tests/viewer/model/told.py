"""States and actions in words, for golden texts: what an action changes, field by field, and what follows from it."""

import sys
from dataclasses import MISSING, fields, is_dataclass, replace

from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE
from viewer.model import depth, depth_models, folder, inspection, lens, saving, stereo, units
from viewer.model.commands import recent_commands
from viewer.model.history import Edit
from viewer.model.inspection import view_near
from viewer.model.presets import active_preset
from viewer.model.viewpoint import clicked_rack
from viewer.model.window import layout_for

MODULES = (
    "messages", "preferences", "inspection", "stereo", "depth_models", "folder", "lens", "opening", "tracking",
    "viewpoint", "window",
)  # fmt: skip
"""Modules with verbs that `setter` and its like made."""
EXACT = 1e-4, 1e-4
"""Tolerances (absolute, relative) of numbers that are written with five digits."""
SCREEN = ScreenSize(1100, 700)
"""Size of the window, and of the screen of stereo pictures."""


def words(value):
    """Return a value in words: numbers to five digits, records without what they have anyway."""
    if isinstance(value, bool | None | str):
        return repr(value).replace(str(resource_folder("assets")), "<assets>")
    if isinstance(value, complex):
        return f"{words(value.real)} right, {words(value.imag)} down"
    if isinstance(value, int | float):
        return f"{round(value, 9) + 0.0:.5g}"
    if isinstance(value, Scene):
        return f"<{value.name}, {value.grid.rows} x {value.grid.columns}>"
    if isinstance(value, Edit):
        return "edit"
    if is_dataclass(value) and not isinstance(value, type):
        changed = (field for field in fields(value) if getattr(value, field.name) != usual(field))
        return f"{type(value).__name__}({', '.join(f'{f.name}={words(getattr(value, f.name))}' for f in changed)})"
    if isinstance(value, frozenset):
        value = sorted(value)
    if isinstance(value, tuple | list):
        return f"({', '.join(map(words, value))})"
    return value.verb.__name__ if hasattr(value, "verb") else str(value)


def usual(field):
    return field.default_factory() if field.default_factory is not MISSING else field.default


def name_of(verb):
    """Return a verb's name with its module, whatever it was made by."""
    modules = [sys.modules[verb.__module__], *(sys.modules[f"viewer.model.{name}"] for name in MODULES)]
    for module in modules:
        name = next((name for name, value in vars(module).items() if value is verb), None)
        if name is not None:
            return f"{module.__name__.rpartition('.')[2]}.{name}"
    raise AssertionError(f"{verb} is no verb of the model")


def title(action):
    """Return an action in words."""
    options = (f"{name}={words(value)}" for name, value in action.kwargs)
    return f"{name_of(action.verb)}({', '.join((*map(words, action.args), *options))})"


def changes(before, after, name=""):
    """Yield each field that differs, in words; of longer tuples what was added."""
    if before == after and (before is after or not isinstance(before, Scene)):
        return
    if is_dataclass(before) and type(before) is type(after) and not isinstance(before, Scene):
        for field in fields(before):
            part = f"{name}.{field.name}".lstrip(".")
            yield from changes(getattr(before, field.name), getattr(after, field.name), part)
    elif isinstance(before, tuple) and isinstance(after, tuple) and name.startswith("history"):
        yield f"{name}: {len(before)} -> {len(after)}"
    elif isinstance(before, tuple) and type(after) is tuple and before and before == after[: len(before)]:
        yield f"{name}: + {words(after[len(before) :])}"
    else:
        yield f"{name}: {words(before)} -> {words(after)}"


def consequences(state):
    """Return what other parts of the program derive from a state."""
    scene = state.scene
    found = {
        "making views": state.is_making_views, "panel hidden": state.is_panel_hidden,
        "eye at rest": state.at_rest.optics.eye, "shows the photo": state.shown_optics != state.optics,
        "wanted model": depth_models.wanted_model(state), "offered": depth_models.offered_model(state),
        "usual model": depth_models.usual_model(state), "worker's depth": depth.settings_for_worker(state),
        "strength asked for": lens.requested_strength(state), "beside": inspection.beside_of(state),
        "recent": tuple(command.name for command in recent_commands(state)),
        "ahead": tuple(source.path for source in folder.photos_ahead(state, folder.AHEAD)),
        "filmstrip": tuple(folder.filmstrip_range(state, 3)), "monitor": stereo.monitor_of(state),
    }  # fmt: skip
    if scene is None:
        return found
    weave, optics = stereo.weave_of(state, scene, SCREEN), state.optics
    pair, alike = (weave.eyes[0], weave.eyes[-1]), replace(state.shown_optics, eye=CENTRE)
    return found | {
        "preset": active_preset(state, scene), "rack": clicked_rack(state), "picked": saving.picked_place(state),
        "eye distance": stereo.eye_distance(scene, state.stereo), "warning": stereo.warning(scene, state.stereo),
        "eyes": (len(weave.eyes), *(each.optics.eye for each in pair)),
        "eyes' parts": tuple(each.part for each in pair),
        "eyes' lens is the picture's": all(replace(each.optics, eye=CENTRE) == alike for each in pair),
        "eyes' sizes": (pair[0].size_px, weave.frame_px), "picture": layout_for(state, SCREEN, 2.0, 1.0).frame,
        "left eye looks at": stereo.place_in_photo(weave, 300.0, 200.0), "view": view_near(optics.eye, scene.grid),
        "f-number": units.f_number_text(scene, optics.aperture_diameter),
        "distance": units.relative_distance(scene, optics.focus_disparity),
        "metres": units.metres(scene, optics.focus_disparity), "far": units.far_percent(scene, optics.focus_disparity),
    }  # fmt: skip


def told(before, after):
    """Return the lines about what became of a state."""
    lines = list(changes(before, after))
    then, now = consequences(before), consequences(after)
    return lines + [f"= {name}: {words(now[name])}" for name in now if now[name] != then.get(name)]
