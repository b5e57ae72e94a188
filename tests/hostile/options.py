"""Hostile cases of options: values that mean nothing, that are too large, or that what is opened cannot heed."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np

from tests.hostile.case import Case
from tests.hostile.inputs import COMMANDS
from tests.hostile.sandbox import HEIGHT, WIDTH

HUGE = str(10**30)

_EVERYWHERE = (
    ("--disparity-scale", ("", "x", "nan", "inf", "1,5")),
    ("--depth", ("", "best", "AUTO")),
    ("--refine", ("", "2", "-0.1", "nan", "yes")),
    ("--grid", ("", "0", "-3", "2.5", "3x3x3", "100", HUGE, "9x0", "x")),
    ("--max-pixels", ("0", "-1", "x", "1e6", HUGE)),
    ("--memory", ("0", "-1G", "lots", "1X", HUGE, "9999999999T", "1e400", "nan")),
)
"""Options of every command that opens a photo, with values that are none."""


def _without(words: tuple[str, ...], option: str) -> tuple[str, ...]:
    """The words but for this option and its value."""
    kept = [pair for pair in zip(words[::2], words[1::2]) if pair[0] != option]
    return tuple(word for pair in kept for word in pair)


def _hide_map(folder: Path) -> None:
    """A photo beside which there is nothing that could give it depth."""
    (folder / "model").mkdir()
    (folder / "model" / "config.json").write_text("{}")
    shutil.copy(folder / "photo.png", folder / "bare.png")


def _write_poses(folder: Path) -> None:
    """Cameras that look where the photo does; one that looks away; of pictures of another shape; none."""
    turned = np.diag([-1.0, 1.0, -1.0, 1.0])
    for name, sides, matrices in (
        ("poses", (WIDTH, HEIGHT), [np.eye(4)]),
        ("away", (WIDTH, HEIGHT), [np.eye(4), turned]),
        ("square", (7, 7), [np.eye(4)]),
    ):
        frames = [{"transform_matrix": matrix.tolist()} for matrix in matrices]
        whole = {"w": sides[0], "h": sides[1], "fl_x": 50.0, "frames": frames}
        (folder / f"{name}.json").write_text(json.dumps(whole))
    (folder / "empty.json").touch()


_values = [
    Case(
        f"{command} {option} {value!r}",
        (command, "photo.png", *_without(COMMANDS[command], option), option, value),
        says=option,
    )
    for number, (option, values) in enumerate(_EVERYWHERE)
    for index, value in enumerate(values)
    # Each value meets one of the commands, in turn: they share the options.
    for command in (list(COMMANDS)[(number + index) % len(COMMANDS)],)
]

_screenshot = [
    Case(f"screenshot {option} {value!r}", ("screenshot", "photo.png", "-o", "new.png", option, value), says=option)
    for option, values in (
        ("--view", ("", "1", "1,2,3", "a,b", "nan,0", "99,99", "-1e300,0")),
        ("--focus", ("", "x", "nan", "inf")),
        ("--aperture", ("", "x", "nan", "-1")),
        ("--size", ("", "12", "0x5", "axb", "99999x1", f"{HUGE}x1")),
        ("--backend", ("", "vulkan")),
        ("--gloss", ("", "missing", "photo.png", "map.pfm")),
        ("--quality", ("", "best", "exact")),
        ("--inpaint", ("", "magic", "diffusion", "diffusion:", "patch")),
        ("--depth-strength", ("", "nan", "1e300")),
        ("--focus-disparity", ("", "inf")),
    )
    for value in values
]
_screenshot += [
    Case(
        "screenshot --full and a size",
        ("screenshot", "photo.png", "-o", "new.png", "--full", "--size", "8x8"),
        says="--full",
    ),
    Case("screenshot --full of a photo", ("screenshot", "photo.png", "-o", "new.png", "--full"), 0, "", ("new.png",)),
]

_export = [
    Case(f"export {' '.join(words)}", ("export", "photo.png", *words), says=says)
    for words, says in (
        (("--to", "hologram", "-o", "new.png"), "hologram"),
        (("--to", "", "-o", "new.png"), "--to"),
        (("--to", "quilt"), "-o"),
        (("-o", "new.png"), "--to"),
        (("--to", "quilt", "-o", "new.txt"), ".png"),
        (("--to", "quilt", "-o", "new.png", "--device", "holodeck"), "holodeck"),
        (("--to", "quilt", "-o", "new.png", "--frames", "3"), "--frames"),
        (("--to", "anaglyph", "-o", "new.png", "--device", "go"), "--device"),
        (("--to", "anaglyph", "-o", "new.png", "--show"), "--show"),
        (("--to", "quilt", "-o", "new.png", "--show", "--grid", "1"), "Looking Glass Bridge"),
        (("--to", "sbs", "-o", "new.png", "--eyes", "nan"), "--eyes"),
        (("--to", "gif", "-o", "new.gif", "--motion", "dance"), "--motion"),
        (("--to", "gif", "-o", "new.gif", "--frames", "0"), "--frames"),
        (("--to", "gif", "-o", "new.gif", "--rate", "0"), "--rate"),
        (("--to", "gif", "-o", "new.gif", "--path", "missing"), "missing"),
        (("--to", "gif", "-o", "new.gif", "--path", "map.pfm"), "map.pfm"),
        (("--to", "mp4", "-o", "new.mp4", "--size", "33x24", "--grid", "1"), "32x24"),
        (("--to", "sbs", "-o", "new.png", "--size", "0x4"), "--size"),
        (("--to", "sbs", "-o", "new.png", "--literal"), "--grid"),
        (("--to", "hci", "-o", "new", "--literal", "--grid", "3", "--depth-strength", "2"), "--depth-strength"),
        (("--to", "anaglyph", "-o", "photo.png", "--force"), "photo.png"),
        (("--to", "epi", "-o", "new.png", "--row", "999", "--grid", "1"), "row 999"),
        (("--to", "splats", "-o", "new.ply", "--depth", "flat"), "flat"),
        (("--to", "disparity", "-o", "new_depth.pfm", "--grid", "1"), "_depth"),
        (("--to", "eslf", "-o", "new.png"), "_eslf.png"),
        (("--to", "hci", "-o", "field"), "field"),
        (("--to", "colmap", "-o", "folder/../field", "--force"), "field"),
        (("--to", "anaglyph", "-o", "saved.png"), "--force"),
        (("--to", "anaglyph", "-o", "missing/new.png"), "missing"),
        (("--to", "anaglyph", "-o", "new.png", "--view", "1,1"), "--view"),
        (("--to", "hci", "-o", "new", "--gloss", "missing"), "missing"),
    )
]

_POSES = ("generate", "photo.png", "--disparity", "map.pfm", "--out", "new")
_generate = [
    Case(f"generate {' '.join(words)}", (*_POSES, *words), says=says, prepare=_write_poses)
    for words, says in (
        ((), "--grid"),
        (("--poses", "poses.json", "--grid", "3"), "--grid"),
        (("--grid", "3", "--photo-pose", "1"), "--photo-pose"),
        (("--poses", "poses.json", "--photo-pose", "0"), "--photo-pose"),
        (("--poses", "poses.json", "--photo-pose", "9"), "--photo-pose 9"),
        (("--poses", "poses.json", "--quality", "fast", "--format", "hci"), "--format and --quality"),
        (("--poses", "missing"), "missing"),
        (("--poses", "folder"), "poses_bounds.npy"),
        (("--poses", "text.txt"), "text.txt"),
        (("--poses", "map.pfm"), "map.pfm"),
        (("--poses", "away.json"), "pose 2"),
        (("--poses", "square.json"), "pictures of 7x7"),
        (("--poses", "empty.json"), "empty"),
        (("--poses", "poses.json", "--literal"), "not positive"),
        (("--poses", "poses.json", "--memory", "1M"), "memory"),
    )
]
_generate += [
    Case("generate poses", (*_POSES, "--poses", "poses.json"), 0, makes=("new", "new/view_0001.png"),
         prepare=_write_poses),
    Case("view a field with poses", ("view", "field", "--poses", "poses.json"), says="--poses", prepare=_write_poses),
    Case("view with no poses", ("view", "photo.png", "--poses", "empty.json"), says="empty", prepare=_write_poses),
    Case("view with a pose's number", ("view", "photo.png", "--photo-pose", "1"), says="--photo-pose"),
    Case("generate poses into a folder", (*_POSES[:-1], "field", "--poses", "poses.json", "--force"), says="field",
         prepare=_write_poses),
]  # fmt: skip

_clamped = [
    Case(
        f"screenshot {option} {value}", ("screenshot", "photo.png", "-o", "new.png", option, value), 0, "", ("new.png",)
    )
    for option, value in (("--focus", "1e300"), ("--focus", "-1e300"), ("--aperture", "1e300"))
]

_inpainters = [
    Case(f"{command} --inpaint {typed}", (command, "photo.png", *COMMANDS[command], "--inpaint", typed), says=says)
    for command, typed, says in (
        ("screenshot", "diffusion:missing/model", "missing/model"),
        ("generate", "diffusion:photo.png", "photo.png"),
    )
] + [
    Case(
        "generate --inpaint with an empty folder",
        ("generate", "photo.png", "--disparity", "map.pfm", *COMMANDS["generate"], "--inpaint", "diffusion:folder"),
        says="folder",
    ),
]

_models = [
    Case(f"{command} {words}", (command, "bare.png", *COMMANDS[command], *more), prepare=_hide_map, says=says)
    for command in ("plan", "screenshot", "generate")
    for words, more, says in (
        ("--depth-model unknown", ("--depth-model", "unknown"), "unknown"),
        ("--depth-model in a missing folder", ("--depth-model", "missing/model"), "missing/model"),
        ("--depth-model a file", ("--depth-model", "photo.png"), "photo.png"),
        ("--depth-model an empty folder", ("--depth-model", "folder"), "folder"),
        ("--depth-model a folder that says nothing", ("--depth-model", "model"), "model"),
        ("--depth-model not here", ("--depth-model", "depth-pro"), "depth-pro"),
        ("--depth model without one", ("--depth", "model"), "--depth model"),
    )
] + [
    Case("view --depth-model unknown", ("view", "photo.png", "--depth-model", "unknown"), says="unknown"),
    Case("view --depth model", ("view", "photo.png", "--depth", "model"), says="--depth model"),
    Case(
        "evaluate --depth-model unknown",
        ("evaluate", "field", "--out", "new", "--depth-model", "unknown", "--views", "1"),
        says="unknown",
    ),
]

_contradictions = [
    Case(f"{command} {' '.join(more)}", (command, "photo.png", *COMMANDS[command], *more), says=more[0])
    for command in ("plan", "screenshot")
    for more in (
        ("--disparity", "map.pfm", "--depth", "rough"),
        ("--disparity", "map.pfm", "--depth-model", "depth-pro"),
        ("--depth", "flat", "--depth-model", "depth-pro"),
    )
]

_IGNORED_BY_FOLDERS = (
    ("--disparity-scale", "2"), ("--depth", "rough"), ("--depth-model", "depth-pro"), ("--refine", "off"),
    ("--depth-strength", "2"), ("--focus-disparity", "1"), ("--grid", "3"),
    ("--max-pixels", "100"), ("--quality", "fast"), ("--inpaint", "background"),
)  # fmt: skip
"""A light field brings views of its own: what says how views are made says nothing about them."""

_ignored = [
    Case(f"{command} a light field {' '.join(more)}", (command, "field", *COMMANDS[command], *more), says=more[0])
    for command, each in (("screenshot", _IGNORED_BY_FOLDERS), ("view", _IGNORED_BY_FOLDERS[:3]))
    for more in each
]

_dense_fields = [
    Case(f"generate a light field {' '.join(words)}", ("generate", "field", *words), says=says)
    for words, says in (
        (("--grid", "4", "--out", "new"), "5x5"),
        (("--grid", "3", "--out", "new"), "5x5"),
        (("--grid", "5", "--out", "field", "--force"), "field"),
        (("--grid", "5", "--out", "new", "--refine", "off"), "--refine"),
        (("--grid", "5", "--out", "new", "--disparity", "map.pfm"), "--disparity"),
        (("--grid", "5", "--out", "new", "--literal"), "--literal"),
    )
] + [Case("generate between views", ("generate", "field", "--grid", "5", "--out", "new"), 0, "", ("new",))]

_others = [
    Case(f"{' '.join(words)[:60]}", words, says=says)
    for words, says in (
        (("screenshot", "field", "-o", "new.png", "--disparity", "missing.pfm"), "missing.pfm"),
        (("depth", "missing", "-o", "new.pfm"), "missing"),
        (("depth", "field", "-o", "new.jpg"), "new.jpg"),
        (("depth", "field", "-o", "field/new.pfm"), "new.pfm"),
        (("fly",), "fly"),
        (("plan",), "photo"),
        (("plan", "photo.png", "photo.png"), "photo.png"),
        (("plan", "photo.png", "--fly"), "--fly"),
        (("plan", "--", "--fly"), "--fly"),
        (("--fly",), "--fly"),
        (("generate", "photo.png", "--grid", "3", "--out", "new", "--format", "mp4"), "mp4"),
        (
            ("generate", "photo.png", "--disparity", "map.pfm", "--grid", "3", "--out", "new", "--depth-strength", "2"),
            "--depth-strength",
        ),
        (("generate", "photo.png", "--grid", "99", "--out", "new", "--memory", "1K"), "--memory"),
        (("view", "photo.png", "--ground-truth", "missing"), "missing"),
        (("view", "photo.png", "--ground-truth", "photo.png"), "photo.png"),
        (("evaluate", "field", "--out", "new", "--views", "0"), "--views"),
        (("evaluate", "field", "--out", "new", "--disparity", "missing.pfm"), "missing.pfm"),
        (("evaluate", "field", "--out", "new", "--disparity", "folder"), "folder"),
        (("evaluate", "field", "--out", "new", "--lpips", "missing"), "missing"),
        (("evaluate", "field", "--out", "new", "--quality", "best"), "--quality"),
        (("train", "--steps", "0", "--out", "new.safetensors"), "--steps"),
        (("train", "--steps", "1", "--seed", "-1", "--out", "new.safetensors"), "--seed"),
        (("train", "--steps", "1", "--seed", HUGE, "--out", "new.safetensors"), "--seed"),
        (("train", "--steps", HUGE, "--out", "new.safetensors"), "--steps"),
        (("train", "--steps", "1", "--learning-rate", "nan", "--out", "new.safetensors"), "--learning-rate"),
        (("train", "--steps", "1", "--learning-rate", "-1", "--out", "new.safetensors"), "--learning-rate"),
        (("train", "--steps", "1", "--learning-rate", "2", "--out", "new.safetensors"), "--learning-rate"),
        (("train", "--steps", "1", "--device", "abacus", "--out", "new.safetensors"), "abacus"),
        (("train", "--steps", "1", "--checkpoint-every", "0", "--out", "new.safetensors"), "--checkpoint-every"),
        (("models", "get"), "name"),
        (("models", "get", "unknown"), "unknown"),
        (("models", "get", "../../unknown"), "unknown"),
        (("models", "get", "depth-pro"), "--yes"),
        (("models", "lose"), "lose"),
        (("bench",), "make bench"),
    )
]

OPTION_CASES = (
    *_values,
    *_screenshot,
    *_export,
    *_generate,
    *_clamped,
    *_inpainters,
    *_models,
    *_contradictions,
    *_ignored,
    *_dense_fields,
    *_others,
)
