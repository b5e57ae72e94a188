"""`iibr plan`: what a photo needs, in words."""

from __future__ import annotations

from viewer.cli.option_records import with_option_records
from viewer.cli.scene_options import SceneOptions
from viewer.cli.shared_options import FocusDisparity, Grid, PhotoPath


@with_option_records
def plan(photo: PhotoPath, scene: SceneOptions, focus_disparity: FocusDisparity = None, grid: Grid = None) -> None:
    """Say what this photo needs, and why, without making any view.

    Example: iibr plan photo.png --disparity photo.pfm
    """
    from iibr_core.scenes.photo import load_photo, make_plan

    source = scene.source(photo, grid, focus_disparity)
    loaded = load_photo(source)
    chosen = make_plan(source, loaded, scene.depth_strength)
    height, width = loaded.photo.size
    print(f"{loaded.photo.name}: {width}x{height} px, disparity from {loaded.disparity.source}")
    for line in (*chosen.reasons, *loaded.photo.notes, *loaded.disparity.notes):
        print(f"- {line}")
