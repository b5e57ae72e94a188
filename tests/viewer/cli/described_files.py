"""Files that commands write, in words and numbers that a golden text keeps, and how two such texts are compared."""

import json
import re
from io import BytesIO
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import Image, ImageCms, ImageSequence

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
MAX_OFF, MAX_SHARE, MAX_OFF_FOUND = 0.03, 0.01, 0.3
"""Largest difference of two numbers with a point: absolute, as a share of the larger one, and in lines with the word
`found`, whose numbers views are searched for."""
MAX_STEPS = 1
"""Largest difference of two levels of a picture, of 255."""
PARTS = 3
"""Number of parts of a picture, across and down, whose means are described."""


def described(path: Path) -> list[str]:
    """Return the lines of a file, or of a folder's files; of each kind of file in a folder, the first and the last in
    full.
    """
    if not path.is_dir():
        return [path.name, *(f"    {line}" for line in _lines_of(path))]
    lines, paths = [f"{path.name}/"], sorted(path.iterdir())
    for each in paths:
        alike = [other for other in paths if (other.suffix, other.name[:4]) == (each.suffix, each.name[:4])]
        lines += described(each)[: None if each in (alike[0], alike[-1]) else 2]
    return lines


def _lines_of(path):
    if path.name.startswith("found"):
        rows = _means(_read_map(path), np.median)
        return ["found " + " | ".join(f"{part[0]:.2f}" for part in row) for row in rows]
    for endings, describe in (
        (".png .jpg .webp .gif .tif .avif", _picture), (".exr .npy .pfm", lambda path: _values(_read_map(path))),
        (".npz", _arrays), (".html", _page), (".cfg .md .csv .txt", _text),
    ):  # fmt: skip
        if path.suffix in endings.split():
            return describe(path)
    return []


def _picture(path):
    with Image.open(path) as image:
        frames = [np.asarray(frame.convert("RGB")).astype(float) for frame in ImageSequence.Iterator(image)]
        exif, profile = image.getexif(), image.info.get("icc_profile")
        facts = [f"{image.format} {image.width}x{image.height} {_mode(path, image)}", f"{len(frames)} frames"]
        facts += [f"{image.info['duration']:.0f} ms"] if "duration" in image.info else []
        facts += [ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(BytesIO(profile))).strip()] if profile else []
        facts += [f"quantized by {sum(image.quantization[0])}"] if getattr(image, "quantization", None) else []
        facts += [f"tag {tag:x}: {value}" for tag, value in sorted(exif.items()) if isinstance(value, str)][:9]
        facts += ["with position"] if exif.get_ifd(0x8825) else []
    shown = frames[:: max(len(frames) - 1, 1)]
    return [", ".join(facts), *(line for frame in shown for line in _levels(frame))]


def _mode(path, image):
    """Return the mode as Pillow has it; 16 bits of colour are stated by the file's header."""
    return "16 bits" if path.suffix == ".png" and path.read_bytes()[24] == 16 else image.mode


def _levels(pixels):
    """Return the mean colours of parts, and how much neighbours differ across and down."""
    across, down = (np.abs(np.diff(pixels.mean(axis=2), axis=axis)).mean() for axis in (1, 0))
    rows = [" | ".join(" ".join(f"{level:.0f}" for level in part) for part in row) for row in _means(pixels)]
    return [*(f"levels {row}" for row in rows), f"levels differ by {across:.2f} {down:.2f}"]


def _means(values, mean=np.mean):
    parts = min(PARTS, *values.shape[:2])
    rows = (np.array_split(row, parts, axis=1) for row in np.array_split(values, parts, axis=0))
    return [[np.atleast_1d(mean(part, axis=(0, 1))) for part in row] for row in rows]


def _read_map(path):
    return np.load(path) if path.suffix == ".npy" else oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)


def _values(values):
    values = np.squeeze(np.asarray(values, float))
    shape = "x".join(map(str, values.shape))
    if values.ndim < 2 or values.ndim > 3:
        return [f"{shape}: {values.mean():.3f} {values.std():.3f}"]
    rows = [" | ".join(" ".join(f"{each:.3f}" for each in part) for part in row) for row in _means(values)]
    return [f"{shape}: {values.min():.3f} to {values.max():.3f}", *rows]


def _arrays(path):
    with np.load(path) as arrays:
        return [f"{name} {line}" for name in sorted(arrays) for line in _values(arrays[name])]


def _page(path):
    if 'id="field"' not in path.read_text("utf-8"):
        return []
    field = json.loads(path.read_text("utf-8").partition('id="field">')[2].partition("</script>")[0])
    left_out = ("numbers", "chunks")
    return [f"{name}: {json.dumps(value)}" for name, value in field.items() if name not in left_out]


def _text(path):
    lines = path.read_text("utf-8", "replace").splitlines()
    return [line for line in lines if path.suffix != ".md" or line.startswith(("|", "-"))]


def difference(text: str, golden: str) -> str | None:
    """Return the first two lines that differ in a word, or in a number by more than its tolerance; None if none do."""
    lines, wanted = text.splitlines(), golden.splitlines()
    for line, other in zip(lines, wanted):
        if NUMBER.sub("#", line) != NUMBER.sub("#", other):
            return f"{line!r}, expected {other!r}"
        for one, two in zip(NUMBER.findall(line), NUMBER.findall(other)):
            if not _agree(one, two, line):
                return f"{one} in {line!r}, expected {two} in {other!r}"
    return None if len(lines) == len(wanted) else f"{len(lines)} lines, expected {len(wanted)}: {lines[-1]!r}"


def _agree(one, other, line):
    off, most = abs(float(one) - float(other)), MAX_OFF_FOUND if "found" in line else MAX_OFF
    if "." in one + other:
        return off <= most + MAX_SHARE * abs(float(other))
    return off <= (MAX_STEPS if line.lstrip().startswith("levels") else 0)
