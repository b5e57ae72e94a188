"""The table of all kinds of export, and the options of an export.

The window's dialog and the command line read this table; a new kind is one line here and one function in this package.
Functions are named as "module:function" and imported when they are used, so that the table loads quickly.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Literal

from iibr_core.beyond.optics import Optics
from iibr_core.formats.animations import VIDEOS, even_size, video_width
from iibr_core.formats.light_fields.write import check_light_field
from iibr_core.formats.outputs import check_output, check_output_folder
from iibr_core.scenes.lens_limits import focus_span
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ImageSize, InputError

AnimationKind = Literal["circle", "eight", "swing", "focus", "rack", "aperture"]
ANIMATIONS: tuple[AnimationKind, ...] = ("circle", "eight", "swing", "focus", "rack", "aperture")
"""Motions of an animation: the viewpoint on a loop, the focus from near to far and back, the focus from one surface to
another and back, or the aperture."""
DepthLayout = Literal["right", "left", "below"]
DEPTH_LAYOUTS: tuple[DepthLayout, ...] = ("right", "left", "below")
"""Places of the depth map beside its picture."""
Target = Literal["headset"]
HEADSET_GRID = GridShape(5, 9)
"""Grid of a photo's views for headsets: between both eyes lie three views, and a head moves more to the sides."""
STACK_BITS = 8, 16
SOFT_SHARE = 0.1
"""Default width of a mask's soft ends, as a share of the range of the focus."""
MAX_SIDE_VIEWS = 33
"""Largest number of views a side that the window offers."""
DEFAULT_SIZE = ScreenSize(0, 0)
DEFAULT_SECONDS = 4.0
"""Length of an animation."""
MAX_FRAMES = 10_000
RATE_LIMITS = 0.1, 240.0
"""Lowest and highest frame rate, in frames a second."""
MAX_PICTURE_RATE = 50.0
"""Highest frame rate of GIF and WebP: browsers show a frame of less than 20 ms for 100 ms."""
Purpose = Literal["share", "display", "software"]
PURPOSES: dict[Purpose, str] = {"share": "Share", "display": "3D displays", "software": "Other software"}
"""Purposes of an export, with their words for the user."""


@dataclass(frozen=True)
class ExportOptions:
    """Options of an export. Zero sizes, frames and rates and negative eyes and rows stand for the default of the kind,
    which `with_defaults` fills in.

    size: (width, height) of each picture in pixels. device: name of a display in `DEVICES`, None for any. eyes: view
    steps from the first viewpoint to the last. keys: file with a camera path, which replaces the motion. rack: the two
    focus disparities (px per view step) of the motion "rack", None for the nearest and the farthest. frames: number of
    frames of an animation or pictures of a stack. rate: frames a second. row: row of an epipolar plane image. show:
    whether a quilt is shown on a display. budget: maximum size of a web page in bytes, None for no limit. credit:
    whether the page names the photo's title, author and rights. target: device that shows the page, None for any
    browser. layout: place of the depth map beside its picture. bits: bits a channel of the pictures of a stack. grid:
    views of a photo that are written, None for those of the scene. at: place (x, y) of a surface, in pixels of the
    photo. tolerance: factor of the contrast that ends it. soft: disparity over which the ends of a mask fade; negative
    for the default.
    """

    size: ScreenSize = DEFAULT_SIZE
    device: str | None = None
    eyes: float = -1.0
    motion: AnimationKind = "circle"
    keys: Path | None = None
    rack: tuple[float, float] | None = None
    frames: int = 0
    rate: float = 0.0
    row: int = -1
    show: bool = False
    budget: int | None = None
    credit: bool = False
    target: Target | None = None
    layout: DepthLayout = "right"
    bits: int = 8
    grid: GridShape | None = None
    at: tuple[float, float] | None = None
    tolerance: float = 1.0
    soft: float = -1.0


DEFAULT_OPTIONS = ExportOptions()


@dataclass(frozen=True)
class ExportKind:
    """A kind of export.

    words: its name for the user. endings: endings of the file, the default first; none for a folder. write: function
    that writes it. supports: names of the supported options, those of the lens included. variant: argument of the
    functions that several kinds share. optics: function that finds the optics of the drawn pictures, "" if nothing is
    drawn. path: function that completes the file name. own_files: regular expression of the files in a folder that may
    be replaced. needs: packages of the extra `export`. frames: default number of pictures of a stack. rate: default
    frames a second. max_rate: highest one, 0 for any. max_width_px: largest default width, 0 for any. has_colors:
    whether gloss is visible in it. is_light_field: whether it is a light field in the layout `variant`. gallery:
    function that lists the exports of a batch.
    """

    words: str
    endings: tuple[str, ...]
    write: str
    supports: tuple[str, ...] = ()
    variant: str = ""
    optics: str = ""
    path: str = ""
    own_files: str = ""
    needs: tuple[str, ...] = ()
    frames: int = 0
    rate: float = 0.0
    max_rate: float = 0.0
    max_width_px: int = 0
    has_colors: bool = True
    is_light_field: bool = False
    gallery: str = ""
    purpose: Purpose = "share"

    @property
    def is_drawn(self) -> bool:
        """Whether the graphics card draws it; otherwise it is made from the views."""
        return bool(self.optics)

    def function(self, entry: str) -> Callable[..., Any]:
        """Return the function of an entry such as `write`, with the variant if the kind has one."""
        function: Callable[..., Any] = resolve_name(f"{__package__}.{entry}")
        return partial(function, variant=self.variant) if self.variant else function


MAP = (".pfm", ".exr", ".npy", ".png", ".tif")
PICTURE = (".png", ".jpg", ".jpeg", ".webp", ".avif", ".tif", ".tiff")
GREY = (".png", ".tif", ".tiff")
EYES = ("focus", "aperture", "size", "eyes")
GRID = ("grid",)
STACK_FILES = r"(focus_\d+|all_in_focus)\.png|disparity\.pfm"
CAMERA_FILES = r"images/v\d+_u\d+\.png|poses_bounds\.npy|transforms\.json|sparse/0/\w+\.(txt|bin)"


def _stereo(words: str, variant: str, path: str = "stereo:stereo_path") -> ExportKind:
    optics = "stereo:optics_of_eyes"
    return ExportKind(words, PICTURE, "stereo:write_stereo", EYES, variant, optics, path, purpose="display")


def _animation(words: str, ending: str, rate: float, max_width_px: int = 0, needs: tuple[str, ...] = ()) -> ExportKind:
    supports = ("view", "focus", "aperture", "size", "motion", "rack", "keys", "frames", "rate")
    return ExportKind(
        words, (ending,), "animation:write_motion", supports,
        optics="animation:optics_on_path", needs=needs, rate=rate, max_width_px=max_width_px,
        max_rate=0 if needs else MAX_PICTURE_RATE,
    )  # fmt: skip


def _cameras(words: str, variant: str) -> ExportKind:
    write = "cameras:write_cameras"
    return ExportKind(words, (), write, GRID, variant, own_files=CAMERA_FILES, purpose="software")


def _light_field(words: str, variant: str, endings: tuple[str, ...] = ()) -> ExportKind:
    write = "cameras:write_light_field"
    return ExportKind(words, endings, write, GRID, variant, is_light_field=True, purpose="software")


EXPORTS = {
    "quilt": ExportKind(
        "Quilt for light-field displays", PICTURE, "quilt:write_quilt", ("focus", "aperture", "device", "show"),
        optics="quilt:optics_of_quilt", path="quilt:quilt_path", purpose="display",
    ),
    "rgbd": ExportKind("Picture with depth", PICTURE, "maps:write_rgbd", ("layout",), purpose="display"),
    "sbs": _stereo("Side by side", "sbs"),
    "half-sbs": _stereo("Side by side, half width", "half-sbs"),
    "over-under": _stereo("Left eye over right", "over-under"),
    "half-over-under": _stereo("Left eye over right, half height", "half-over-under"),
    "cross-eyed": _stereo("Side by side, crossed", "cross-eyed", path=""),
    "anaglyph": _stereo("Anaglyph, red-cyan", "anaglyph", path=""),
    "spatial-photo": ExportKind(
        "Spatial photo, HEIC", (".heic",), "stereo:write_spatial", EYES,
        optics="stereo:optics_of_eyes", needs=("pillow_heif",), purpose="display",
    ),
    "web": ExportKind(
        "Web page, one file", (".html",), "web:write_page",
        ("focus", "aperture", "budget", "credit", "target"),
        gallery="web_gallery:write_gallery",
    ),
    "mp4": _animation("Video, MP4", ".mp4", 30, needs=("av",)),
    "webm": _animation("Video, WebM", ".webm", 30, needs=("av",)),
    "gif": _animation("Animation, GIF", ".gif", 15, 480),
    "webp": _animation("Animation, WebP", ".webp", 25, 960),
    "focal-stack": ExportKind(
        "Focal stack, PNGs", (), "stack:write_focal_stack", ("view", "focus", "aperture", "size", "frames", "bits"),
        optics="stack:optics_of_stack", own_files=STACK_FILES, frames=16, purpose="software",
    ),
    "epi": ExportKind("Epipolar plane image", (".png",), "maps:write_epi", ("row",), purpose="software"),
    "disparity": ExportKind("Disparity map", MAP, "maps:write_disparity", has_colors=False, purpose="software"),
    "depth": ExportKind(
        "Depth map", MAP, "maps:write_depth", path="maps:depth_path", has_colors=False, purpose="software"
    ),
    "blur": ExportKind(
        "Defocus map, EXR", (".exr",), "lens_maps:write_blur", ("focus", "defocus"), has_colors=False,
        purpose="software",
    ),
    "depth-mask": ExportKind(
        "Mask of what is in focus", GREY, "lens_maps:write_depth_mask", ("focus", "soft"), has_colors=False,
        purpose="software",
    ),
    "matte": ExportKind(
        "Matte of a surface", GREY, "lens_maps:write_matte", ("at", "tolerance"), has_colors=False, purpose="software"
    ),
    "splats": ExportKind("Gaussian splats", (".ply", ".spz"), "points:write_gaussians", purpose="software"),
    "mesh": ExportKind("Textured mesh, GLB", (".glb",), "mesh:write_mesh", purpose="software"),
    "point-cloud": ExportKind("Point cloud, PLY", (".ply",), "points:write_point_cloud", purpose="software"),
    "llff": _cameras("Cameras, LLFF", "llff"),
    "nerfstudio": _cameras("Cameras, nerfstudio", "nerfstudio"),
    "colmap": _cameras("Cameras, COLMAP", "colmap"),
    "hci": _light_field("Light field, HCI folder", "hci"),
    "eslf": _light_field("Light field, lenslet image", "eslf", ("_eslf.png",)),
    "npz": ExportKind("Light field, NumPy arrays", (".npz",), "cameras:write_arrays", GRID, purpose="software"),
}  # fmt: skip
"""The kinds by the name that the user types."""


def export_kind(name: str) -> ExportKind:
    """Return the kind of this name."""
    if name not in EXPORTS:
        raise InputError(f"{name!r} is not a known kind of export: give {', '.join(EXPORTS)}")
    return EXPORTS[name]


def with_defaults(kind: ExportKind, options: ExportOptions, scene: Scene, optics: Optics) -> ExportOptions:
    """Return the options with the default of the kind for every choice that is open."""
    rate = options.rate or kind.rate
    frames = options.frames or kind.frames or max(round(DEFAULT_SECONDS * rate), 2)
    if 0 < kind.max_rate < rate:  # fewer frames fill the same time
        shown = max(int(frames * kind.max_rate / rate), 1)
        frames, rate = shown, rate * shown / frames
    eyes = options.eyes if options.eyes >= 0 else float(scene.grid.columns - 1)
    aspect = picture_aspect(kind, eyes, scene, optics)
    widest = video_width(aspect) if VIDEOS.keys() & kind.endings else kind.max_width_px
    width = min(round(aspect * scene.height), widest or scene.width)
    return replace(
        options,
        size=options.size if any(options.size) else size_of_width(kind, aspect, width),
        eyes=eyes,
        frames=frames,
        rate=rate,
        row=options.row if options.row >= 0 else scene.height // 2,
        soft=options.soft if options.soft >= 0 else SOFT_SHARE * focus_span(scene),
        grid=options.grid if options.grid is not None and scene.plan is not None else scene.grid,
    )


def picture_aspect(kind: ExportKind, eyes: float, scene: Scene, optics: Optics) -> float:
    """Return width / height of the part of the scene that each picture shows; pictures for eyes are cropped."""
    crop = 2 * shear_margin(scene, optics, eyes) if "eyes" in kind.supports else 0.0
    return max(round(scene.width * (1 - crop)), 1) / scene.height


def shear_margin(scene: Scene, optics: Optics, span_views: float) -> float:
    """Return the share of the width that is cropped at each side of pictures which hold the focused surface still.

    span_views: view steps from the first viewpoint to the last, about the middle of the grid.
    """
    middle = (scene.grid.columns - 1) / 2 - scene.grid.centre[1]
    return abs(optics.focus_disparity) * (abs(middle) + span_views / 2) / scene.width


def size_of_width(kind: ExportKind, aspect: float, width: int) -> ScreenSize:
    """Return the size of this width (pixels) and about this aspect that the kind can have; sides of 4:2:0 are even."""
    size = ImageSize(max(round(width / aspect), 1), width)
    height, width = even_size(size) if {*VIDEOS, ".heic"} & {*kind.endings} else size
    return ScreenSize(width, height)


def require_ending(kind: ExportKind, path: Path) -> None:
    """Raise InputError if a file's name does not end as this kind must."""
    if kind.endings and not path.name.lower().endswith(kind.endings):
        raise InputError(f"{path}: must end in {' or '.join(kind.endings)}")


def export_path(kind: ExportKind, path: Path, scene: Scene, options: ExportOptions) -> Path:
    """Return the path that is written: some kinds add a tag to the name."""
    tagged_path: Path = kind.function(kind.path)(path, scene, options) if kind.path else path
    return tagged_path


def require_export_place(kind: ExportKind, path: Path, inputs: Sequence[Path], may_replace: bool) -> None:
    """Raise InputError if the path cannot be written, AlreadyThereError if it exists and may not be replaced.

    inputs: the files that the export reads.
    """
    require_ending(kind, path)
    if kind.is_light_field:
        check_light_field(path, kind.variant, inputs, may_replace)
    elif kind.endings:
        check_output(path, inputs, may_replace)
    else:
        check_output_folder(path, inputs, may_replace, kind.own_files)


def optics_of(kind: ExportKind, options: ExportOptions, scene: Scene, optics: Optics) -> Sequence[Optics]:
    """Return the optics of the pictures that are drawn of a scene shown with these optics; none if nothing is drawn."""
    if not kind.is_drawn:
        return ()
    find = resolve_name(f"{__package__}.{kind.optics}")
    pictures: Sequence[Optics] = find(scene, optics, with_defaults(kind, options, scene, optics))
    return pictures
