"""Every kind of export: the command line and the window's menu ask here. A new kind is a file of its own in
`iibr_core.exports` and one line.

Light, so that they can be listed before anything is loaded: functions are "module:name" there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from iibr_core.formats.animations import VIDEOS
from iibr_core.types import InputError

LIGHT_FIELD = ("light_field_export:write_light_field",)
MAP = (".pfm", ".exr", ".npy", ".png", ".tif")
PICTURE = (".png", ".jpg", ".jpeg", ".webp", ".avif", ".tif", ".tiff")
DATA = (".png",)
MOVING = ("view", "focus", "aperture", "size", "motion", "keys", "frames", "rate")
STACK_FILES = r"((focus|aperture)_\d+|all_in_focus)\.(png|tif)|disparity\.pfm"
CAMERA_FILES = r"images/v\d+_u\d+\.png|poses_bounds\.npy|transforms\.json|sparse/0/\w+\.txt"
STACK = ("view", "focus", "aperture", "size", "frames")
EYES = ("focus", "aperture", "size", "eyes")
OF_EYES = "stereo_export:optics_of_eyes"
ON_PATH = "animation:optics_on_path"
OF_STACK = "stack:optics_of_focal_stack"
OF_SWEEP = "stack:optics_of_aperture_sweep"
Purpose = Literal["share", "display", "software"]
PURPOSES: dict[Purpose, str] = {"share": "Share", "display": "3D displays", "software": "Other software"}
"""What people export for, in their words."""


@dataclass(frozen=True)
class ExportKind:
    """words: for people. endings: of the file, the usual one first; none: a folder is written. write: writes it.
    supports: names of the supported options about exports and the lens. path: makes the file's name what players
    expect. layout: of a light field, among `WRITERS`. own_files: what a folder may hold that is replaced, as a regular
    expression. needs: packages, of the extra `export`. frames: pictures of a stack. rate: frames a second.
    optics: finds what its pictures are drawn with, "" where nothing is drawn. most_width_px: of pictures whose size
    nobody chose, 0: any. has_colors: else it is a map, and no gloss shows in it. gallery: writes what lists the exports
    of a batch, "" without.
    purpose: what people export it for; "share": everybody can look at it.
    """

    words: str
    endings: tuple[str, ...]
    write: str
    supports: tuple[str, ...] = ()
    path: str = ""
    layout: str = ""
    own_files: str = ""
    needs: tuple[str, ...] = ()
    frames: int = 0
    rate: float = 0.0
    optics: str = ""
    most_width_px: int = 0
    has_colors: bool = True
    gallery: str = ""
    purpose: Purpose = "share"

    @property
    def is_drawn(self) -> bool:
        """Whether the graphics card draws it; else it is made of the views themselves."""
        return "aperture" in self.supports

    @property
    def is_video(self) -> bool:
        """Whether its width and height must be even."""
        return bool(set(self.endings) & set(VIDEOS))


EXPORTS = {
    "quilt": ExportKind(
        "Quilt for light-field displays", PICTURE, "quilt_export:write_quilt",
        ("focus", "aperture", "device", "show"), path="quilt_export:quilt_path",
        optics="quilt_export:optics_of_quilt", purpose="display",
    ),
    "rgbd": ExportKind("Picture with depth at the right", PICTURE, "rgbd:write_beside", purpose="display"),
    "rgbd-left": ExportKind("Picture with depth at the left", PICTURE, "rgbd:write_before", purpose="display"),
    "rgbd-below": ExportKind("Picture with depth below", PICTURE, "rgbd:write_below", purpose="display"),
    "sbs": ExportKind(
        "Side by side", PICTURE, "stereo_export:write_side_by_side", EYES, "stereo_export:full_path",
        optics=OF_EYES, purpose="display",
    ),
    "half-sbs": ExportKind(
        "Side by side, half width", PICTURE, "stereo_export:write_half_side_by_side",
        EYES, "stereo_export:half_path", optics=OF_EYES, purpose="display",
    ),
    "over-under": ExportKind(
        "Left eye over right", PICTURE, "stereo_export:write_over_under",
        EYES, "stereo_export:over_path", optics=OF_EYES, purpose="display",
    ),
    "cross-eyed": ExportKind(
        "Side by side, crossed", PICTURE, "stereo_export:write_cross_eyed", EYES, optics=OF_EYES, purpose="display",
    ),
    "anaglyph": ExportKind(
        "Anaglyph, red-cyan", PICTURE, "stereo_export:write_anaglyph", EYES, optics=OF_EYES, purpose="display",
    ),
    "spatial-photo": ExportKind(
        "Spatial photo, HEIC", (".heic",), "spatial_photo_export:write_spatial", EYES,
        optics=OF_EYES, purpose="display",
    ),
    "web": ExportKind(
        "Web page, one file", (".html",), "web:write_page",
        ("budget", "credit", "stills"), gallery="web_gallery:write_gallery",
    ),
    "mp4": ExportKind(
        "Video, MP4", (".mp4",), "animation:write_motion", MOVING, optics=ON_PATH, needs=("av",), rate=30,
    ),
    "webm": ExportKind(
        "Video, WebM", (".webm",), "animation:write_motion", MOVING, optics=ON_PATH, needs=("av",), rate=30,
    ),
    "gif": ExportKind(
        "Animation, GIF", (".gif",), "animation:write_motion", MOVING, optics=ON_PATH, rate=15, most_width_px=480,
    ),
    "webp": ExportKind(
        "Animation, WebP", (".webp",), "animation:write_motion", MOVING, optics=ON_PATH, rate=25, most_width_px=960,
    ),
    "apng": ExportKind(
        "Animation, PNG", (".png",), "animation:write_motion", MOVING, optics=ON_PATH, rate=15, most_width_px=480,
    ),
    "focal-stack": ExportKind(
        "Focal stack, PNGs", (), "stack:write_focal_stack", STACK,
        optics=OF_STACK, own_files=STACK_FILES, frames=16, purpose="software",
    ),
    "focal-stack-tiff": ExportKind(
        "Focal stack, 16-bit TIFFs", (), "stack:write_focal_tiffs",
        STACK, optics=OF_STACK, own_files=STACK_FILES, frames=16, purpose="software",
    ),
    "focal-stack-exr": ExportKind(
        "Focal stack, OpenEXR", (".exr",), "stack:write_focal_stack", STACK,
        optics=OF_STACK, frames=16, purpose="software",
    ),
    "aperture-sweep": ExportKind(
        "Aperture sweep, PNGs", (), "stack:write_aperture_sweep",
        STACK, optics=OF_SWEEP, own_files=STACK_FILES, frames=9, purpose="software",
    ),
    "aperture-sweep-tiff": ExportKind(
        "Aperture sweep, 16-bit TIFFs", (), "stack:write_aperture_tiffs",
        STACK, optics=OF_SWEEP, own_files=STACK_FILES, frames=9, purpose="software",
    ),
    "aperture-sweep-exr": ExportKind(
        "Aperture sweep, OpenEXR", (".exr",), "stack:write_aperture_sweep", STACK,
        optics=OF_SWEEP, frames=9, purpose="software",
    ),
    "epi": ExportKind("Epipolar plane image", DATA, "maps:write_epi", ("row",), purpose="software"),
    "disparity": ExportKind("Disparity map", MAP, "maps:write_disparity", has_colors=False, purpose="software"),
    "depth": ExportKind(
        "Depth map", MAP, "maps:write_depth", path="maps:depth_path", has_colors=False, purpose="software",
    ),
    "splats": ExportKind("Gaussian splats, PLY", (".ply",), "points:write_gaussians", purpose="software"),
    "point-cloud": ExportKind("Point cloud, PLY", (".ply",), "points:write_point_cloud", purpose="software"),
    "llff": ExportKind(
        "Cameras, LLFF", (), "camera_export:write_llff_folder", own_files=CAMERA_FILES, purpose="software",
    ),
    "nerfstudio": ExportKind(
        "Cameras, nerfstudio", (), "camera_export:write_nerfstudio_folder", own_files=CAMERA_FILES, purpose="software",
    ),
    "colmap": ExportKind(
        "Cameras, COLMAP", (), "camera_export:write_colmap_folder", own_files=CAMERA_FILES, purpose="software",
    ),
    "hci": ExportKind("Light field, HCI folder", (), *LIGHT_FIELD, layout="hci", purpose="software"),
    "numbered-grid": ExportKind(
        "Light field, numbered views", (), *LIGHT_FIELD, layout="numbered-grid", purpose="software",
    ),
    "stanford": ExportKind("Light field, Stanford archive", (), *LIGHT_FIELD, layout="stanford", purpose="software"),
    "eslf": ExportKind("Light field, lenslet image", ("_eslf.png",), *LIGHT_FIELD, layout="eslf", purpose="software"),
    "exr": ExportKind("Light field, one OpenEXR file", (".exr",), *LIGHT_FIELD, layout="exr", purpose="software"),
}  # fmt: skip
"""By the name that people type."""


def export_kind(name: str) -> ExportKind:
    """Raises InputError for a kind that nobody knows."""
    if name not in EXPORTS:
        raise InputError(f"{name!r} is not a known kind of export: give {', '.join(EXPORTS)}")
    return EXPORTS[name]


def require_ending(kind: ExportKind, path: Path) -> None:
    """Raise InputError where a file's name does not say that it is of this kind."""
    if kind.endings and not path.name.lower().endswith(kind.endings):
        raise InputError(f"{path}: must end in {' or '.join(kind.endings)}")
