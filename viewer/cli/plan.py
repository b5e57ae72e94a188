"""`iibr plan`: what a photo needs, in words."""

from __future__ import annotations

from viewer.cli.options import (
    DepthFrom,
    DepthModel,
    DepthStrength,
    DisparityFile,
    DisparityScale,
    FocusDisparity,
    Grid,
    MaxPixels,
    Memory,
    PhotoPath,
    Refine,
    depth_choice,
    require_memory,
)


def plan(
    photo: PhotoPath,
    disparity: DisparityFile = None,
    disparity_scale: DisparityScale = 1.0,
    depth: DepthFrom = "auto",
    depth_model: DepthModel = None,
    refine: Refine = 1.0,
    depth_strength: DepthStrength = 1.0,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    max_pixels: MaxPixels = None,
    memory: Memory = None,
) -> None:
    """Say what this photo needs, and why, without making any view.

    Example: iibr plan photo.png --disparity photo.pfm
    """
    require_memory(memory, keeps_views=True)
    from iibr_core.generation.plan import PlanOverrides, plan_for_viewing
    from viewer.background.loaded_photo import load_photo
    from viewer.model.state.app_state import Source

    choice = depth_choice(disparity, disparity_scale, depth, depth_model, refine, memory)
    loaded = load_photo(Source(str(photo), choice, grid, focus_disparity, max_pixels))
    chosen = plan_for_viewing(
        loaded.photo, loaded.disparity, PlanOverrides(grid, depth_strength, focus_disparity, memory)
    )
    height, width = loaded.photo.size
    print(f"{loaded.photo.name}: {width}x{height} px, disparity from {loaded.disparity.source}")
    for line in (*chosen.reasons, *loaded.photo.notes, *loaded.disparity.notes):
        print(f"- {line}")
