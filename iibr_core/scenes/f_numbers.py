"""F-numbers of apertures in view steps, and back: exact ones where the camera is known, equivalents elsewhere."""

from iibr_core.scenes.scene import Scene

ASSUMED_DISTANCE_M = 2.0
"""Assumed distance of the plane that stays still, at which the full-frame lens of an f-number is focused."""

FULL_FRAME_WIDTH_M = 0.036
EQUIVALENT_FOCAL_M = 0.085


def f_number(scene: Scene, aperture_diameter: float) -> float | None:
    """Return the f-number of an aperture in view steps, None if unknown and for a pinhole."""
    still = disparity_as_given(scene, 0.0)
    if still is None or scene.plan is None or scene.focal_px is None or aperture_diameter <= 0:
        return None
    step_px = abs(scene.plan.disparity_scale) / scene.focal_px
    if scene.inverse_metres is not None and scene.inverse_metres[0]:  # disparity counts inverse metres
        view_step_m = step_px / abs(scene.inverse_metres[0])
    elif still > 0:
        view_step_m = step_px * still * ASSUMED_DISTANCE_M
    else:
        return None
    focal_m = scene.focal_px / scene.width * FULL_FRAME_WIDTH_M
    return focal_m / (aperture_diameter * view_step_m)


def equivalent_f_number(scene: Scene, aperture_diameter: float) -> float | None:
    """Return the f-number of a full-frame portrait lens that blurs as much; None for a pinhole.

    That lens is focused at `ASSUMED_DISTANCE_M` on the nearest surface, with the farthest one at infinity. Painted
    depth does not count, as it does not change the lens.
    """
    far, near = scene.disparity_range_px
    blur_px = aperture_diameter * (near - far if scene.found_span_px is None else scene.found_span_px)
    if not blur_px > 0:
        return None
    return EQUIVALENT_FOCAL_M**2 / ASSUMED_DISTANCE_M * scene.width / FULL_FRAME_WIDTH_M / blur_px


def aperture_of(scene: Scene, stop: float) -> float | None:
    """Return the aperture in view steps of an f-number, as the window shows it; None without depth."""
    unit = unit_f_number(scene)
    return None if unit is None else unit / stop


def unit_f_number(scene: Scene) -> float | None:
    """Return the f-number of an aperture of one view step, exact or else equivalent; None without depth."""
    return f_number(scene, 1.0) or equivalent_f_number(scene, 1.0)


def disparity_as_given(scene: Scene, disparity: float) -> float | None:
    """Return the disparity as given, before the plan; None if no distance follows from it."""
    plan = scene.plan
    if scene.focal_px is None or plan is None or plan.disparity_scale == 0:
        return None
    return disparity / plan.disparity_scale + plan.disparity_zero
