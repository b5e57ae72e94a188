"""Hostile cases of what is written: places where nothing may be, and places where something is already."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tests.hostile.case import Case, nothing
from tests.hostile.inputs import LONG_NAME, NOT_UTF8

WRITING: dict[str, tuple[str, ...]] = {
    "screenshot": ("screenshot", "photo.png", "--disparity", "map.pfm", "--grid", "1", "-o"),
    "generate": ("generate", "photo.png", "--disparity", "map.pfm", "--grid", "1", "--out"),
    "export": ("export", "photo.png", "--disparity", "map.pfm", "--grid", "1", "--to", "anaglyph", "-o"),
    "evaluate": ("evaluate", "field", "--views", "1", "--quality", "fast", "--out"),
    "train": ("train", "--steps", "1", "--out"),
}
"""What writes, all but where to."""

NO_BYTECODE = {"PYTHONDONTWRITEBYTECODE": "1"}
"""Or Python, which does not see that they are cut off, keeps bytes of modules that are no good to anybody."""

SUFFIX = {"screenshot": ".png", "export": ".png", "generate": "", "evaluate": "", "train": ".safetensors"}


def _read_only(folder: Path) -> None:
    (folder / "folder").chmod(0o500)


def _locked(folder: Path) -> None:
    (folder / "folder").chmod(0)


def _put_in_the_way(name: str) -> Callable[[Path], None]:
    """A file of the user's under the name that is written to: in it, where that is a folder."""

    def prepare(folder: Path) -> None:
        there = folder / "folder" / name
        if "." in name:
            there.write_text("mine")
        else:
            there.mkdir()
            (there / "mine.txt").write_text("mine")

    return prepare


def _link_hard(folder: Path) -> None:
    (folder / "hard.png").hardlink_to(folder / "photo.png")


def _link_away(folder: Path) -> None:
    (folder / "away").symlink_to("no/where")


_PLACES: tuple[tuple[str, str, Callable[[Path], None]], ...] = (
    ("in a file", "text.txt/new{suffix}", nothing),
    ("in a read-only folder", "folder/new{suffix}", _read_only),
    ("in a locked folder", "folder/new{suffix}", _locked),
    ("under a long name", LONG_NAME.replace(".png", "{suffix}"), nothing),
    ("under no name", "", nothing),
    ("into a device folder", "/proc/new{suffix}", nothing),
    ("through a loop", "loop.png/new{suffix}", nothing),
    ("onto the photo", "photo.png", nothing),
    ("onto a text", "text.txt", nothing),
)

_places = [
    Case(
        f"{command} {words}",
        (*words_before, place.replace("{suffix}", SUFFIX[command])),
        prepare=prepare,
        is_bound=prepare is not nothing,
    )
    for command, words_before in WRITING.items()
    for words, place, prepare in _PLACES
]

_screenshot = [
    Case(f"screenshot {words}", (*WRITING["screenshot"], place, *more), says=says)
    for words, place, more, says in (
        ("as GIF", "new.gif", (), ".png, .jpg"),
        ("with bits that JPEGs do not have", "new.jpg", ("--bits", "16"), "8 bits"),
        ("with no quality", "new.jpg", ("--picture-quality", "0"), "picture-quality"),
        ("in an unknown profile", "new.png", ("--profile", "cmyk"), "cmyk"),
        ("without a suffix", "new", (), ".png, .jpg"),
        ("onto a folder", "folder", (), "folder"),
        ("onto this folder", ".", (), "."),
        ("onto an existing picture", "saved.png", (), "--force"),
        ("onto the photo by force", "photo.png", ("--force",), "photo.png"),
        ("onto the photo by its whole path", "{folder}/photo.png", ("--force",), "photo.png"),
        ("onto the photo by a detour", "folder/../photo.png", ("--force",), "photo.png"),
        ("onto the photo through a link", "link.png", ("--force",), "link.png"),
        ("onto the picture it is like", "saved.png", ("--like", "saved.png", "--force"), "saved.png"),
        ("into a loop", "loop.png", ("--force",), "loop.png"),
        ("too large", "new.png", ("--size", "16384x16384"), "16384x16384"),
        ("onto a device", "/dev/full", (), "/dev/full"),
    )
] + [
    Case(
        "screenshot onto the photo by its other name",
        (*WRITING["screenshot"], "hard.png", "--force"),
        prepare=_link_hard,
        says="hard.png",
    ),
    Case(
        "screenshot onto its map", ("screenshot", "photo.png", "--disparity", "text.png", "-o", "text.png", "--force")
    ),
    Case("screenshot over a field's view", ("screenshot", "field", "-o", "field/input_Cam004.png", "--force")),
    Case("screenshot into the field it shows", ("screenshot", "field", "-o", "field/new.png"), says="field"),
    Case("screenshot into the field through a link", ("screenshot", "field", "-o", "link-to-field/new.png")),
    Case(
        "screenshot as a JPEG",
        (*WRITING["screenshot"], "new.jpg", "--profile", "p3", "--picture-quality", "50", "--gps"),
        code=0,
        makes=("new.jpg",),
    ),
    Case("screenshot as a TIFF", (*WRITING["screenshot"], "new.tif", "--bits", "16"), code=0, makes=("new.tif",)),
    Case("screenshot by force", (*WRITING["screenshot"], "saved.png", "--force"), code=0, makes=("saved.png",)),
    Case(
        "screenshot through a link",
        (*WRITING["screenshot"], "dangling-into-folder", "--force"),
        says=".png, .jpg",
    ),
    Case("screenshot through a dangling link", (*WRITING["screenshot"], "dangling.png"), code=0, makes=("gone.png",)),
    Case(
        "screenshot under a long name that may be",
        (*WRITING["screenshot"], "n" * 246 + ".png"),
        code=0,
        makes=("n" * 246 + ".png",),
    ),
    Case("screenshot under what is not UTF-8", (*WRITING["screenshot"], NOT_UTF8), code=0, makes=(NOT_UTF8,)),
    Case(
        "screenshot under a name of umlauts", (*WRITING["screenshot"], "größe 大.png"), code=0, makes=("größe 大.png",)
    ),
    Case("screenshot without a place", ("screenshot", "photo.png"), says="-o"),
]


def _write_gloss(folder: Path) -> None:
    (folder / "gloss.toml").write_text('environment = "env.png"')
    (folder / "env.png").write_bytes((folder / "photo.png").read_bytes())
    (folder / "gloss.png").write_text("roughness = 0.3")


_gloss = [
    Case(
        f"{command} onto {place} of its gloss {gloss}",
        (*WRITING[command], place, "--gloss", gloss, "--force"),
        prepare=_write_gloss,
        says="is read here",
    )
    for command in ("screenshot", "export")
    for gloss, place in (("gloss.toml", "env.png"), ("gloss.toml", "folder/../env.png"), ("gloss.png", "gloss.png"))
]

_missing_folders = [
    Case("screenshot in a missing folder", (*WRITING["screenshot"], "missing/new.png"), says="missing"),
    Case("train in a missing folder", (*WRITING["train"], "missing/new.safetensors"), says="missing"),
    Case("generate in a missing folder", (*WRITING["generate"], "missing/new"), code=0, makes=("missing",)),
    Case("evaluate in a missing folder", (*WRITING["evaluate"], "missing/new"), code=0, makes=("missing",)),
]

_generate = [
    Case(f"generate {words}", ("generate", photo, *WRITING["generate"][2:], place, *more), prepare=prepare)
    for words, photo, place, more, prepare in (
        ("over the field that holds the photo", "field/input_Cam004.png", "field", ("--force",), nothing),
        ("over it by a detour", "field/input_Cam004.png", "folder/../field", ("--force",), nothing),
        ("over it through a link", "field/input_Cam004.png", "link-to-field", ("--force",), nothing),
        ("over the folder above", "field/input_Cam004.png", ".", ("--force",), nothing),
        ("over the folder above by its whole path", "photo.png", "{folder}", ("--force",), nothing),
        ("over another field", "photo.png", "field", (), nothing),
        ("over a folder of other things by force", "field/input_Cam004.png", "..", ("--force",), nothing),
        ("over everything", "photo.png", "/", ("--force",), nothing),
        (
            "through a dangling link into nowhere",
            "photo.png",
            "away",
            (),
            lambda at: (at / "away").symlink_to("no/where"),
        ),
    )
] + [
    Case("generate into an empty folder", (*WRITING["generate"], "folder"), code=0, makes=("folder",)),
    Case("generate by force", (*WRITING["generate"], "field", "--force"), code=0, makes=("field",)),
    Case("generate through a link", (*WRITING["generate"], "link-to-folder"), code=0, makes=("folder",)),
    Case("generate under a long name that may be", (*WRITING["generate"], "n" * 250), code=0, makes=("n" * 250,)),
    Case("generate without a place", ("generate", "photo.png", "--grid", "3"), says="--out"),
    Case("generate without a grid", ("generate", "photo.png", "--out", "new"), says="--grid"),
]

_others = [
    Case("evaluate into its data", ("evaluate", "field", "--views", "1", "--out", "field/report")),
    Case("evaluate over its data", ("evaluate", "field", "--views", "1", "--out", "field", "--force")),
    Case("evaluate over its data through a link", ("evaluate", "field", "--out", "link-to-field", "--force")),
    Case("train as something else", ("train", "--steps", "1", "--out", "new.png"), says="new.png"),
    Case("train onto a folder", ("train", "--steps", "1", "--out", "folder"), says="folder"),
    Case("train on from nothing", ("train", "--steps", "1", "--out", "new.safetensors", "--resume")),
    Case(
        "demo in a read-only folder",
        ("demo",),
        shell='cd folder && exec "$@"',
        prepare=_read_only,
        is_bound=True,
        says="out",
    ),
    Case("demo where out is a file", ("demo",), prepare=lambda at: (at / "out").write_text("in the way"), says="out"),
]

_full = [
    Case(
        f"{command} onto a disk with room for {room} bytes",
        (*WRITING[command], f"new{SUFFIX[command]}"),
        limits=(f"--fsize={room}",),
        environment=environment,
    )
    for command in ("screenshot", "generate", "export")
    # Once in a process of its own.
    for room, environment in ((200, NO_BYTECODE), (500, {}))
]

_EXPORTS = {
    "mp4": "new.mp4", "gif": "new.gif", "apng": "new.png", "spatial-photo": "new.heic", "exr": "new.exr",
    "focal-stack-exr": "new.exr", "focal-stack-tiff": "new", "splats": "new.ply", "disparity": "new.pfm",
    "eslf": "new_eslf.png", "hci": "new", "nerfstudio": "new", "web": "new.html",
}  # fmt: skip
"""Kinds of export whose files are written in different ways, and what each is to write."""


def _exporting(kind: str, place: str) -> tuple[str, ...]:
    moving = ("--frames", "3") if kind in ("mp4", "gif", "apng", "focal-stack-exr", "focal-stack-tiff") else ()
    return ("export", "photo.png", "--disparity", "map.pfm", "--grid", "2", "--to", kind, *moving, "-o", place)


_exports = [
    case
    for kind, name in _EXPORTS.items()
    for case in (
        Case(
            f"export {kind} onto a disk with room for 200 bytes",
            _exporting(kind, name),
            limits=("--fsize=200",),
            says=name.partition(".")[0],
        ),
        Case(
            f"export {kind} in a read-only folder",
            _exporting(kind, f"folder/{name}"),
            prepare=_read_only,
            is_bound=True,
            says="folder",
        ),
        Case(
            f"export {kind} onto what is there",
            _exporting(kind, f"folder/{name}"),
            prepare=_put_in_the_way(name),
            says="folder",
        ),
    )
]

OUTPUT_CASES = (*_places, *_missing_folders, *_screenshot, *_gloss, *_generate, *_others, *_full, *_exports)
