"""A page that lists pages: the first picture of each, and its title, for a batch of them. It needs no server either."""

from __future__ import annotations

import base64
import html
import os
import re
from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from string import Template
from urllib.parse import quote

from iibr_core.exports.web import POLICY, hash_of
from iibr_core.formats.files import is_file, read_text
from iibr_core.formats.outputs import write_file
from iibr_core.runtime.resources import resource_folder
from iibr_core.types import InputError

NAME, OTHER_NAME = "index.html", "index-of-pages.html"
"""The other one where a photo's page has the first."""
MARK = "iibr gallery"
SIDE_PX, QUALITY = 480, 70
MOST_START_BYTES = 8_000_000
"""Of a page, with its first picture."""
FIRST = re.compile(rb'<img id="first" alt="([^"]*)" src="data:[\w/]+;base64,([A-Za-z0-9+/=]+)"')
TITLE = re.compile(rb"<title>([^<]*)</title>")
ENTRY = '<li><a href="{link}"><img alt="{alt}" src="{picture}"><span>{title}</span></a></li>'


def write_gallery(folder: Path, outputs: Iterable[str]) -> Path:
    """The index of these pages, by their names in the folder. Returns where it is. Raises InputError where it cannot be
    written, or what is there is none of ours.
    """
    pages = sorted(outputs)
    path = folder / (NAME if NAME not in pages else OTHER_NAME)
    if os.path.lexists(path) and not _is_ours(path):
        raise InputError(f"{path}: already exists and is no gallery; move it, for the index of these pages goes there")
    parts = resource_folder("web")
    style = (parts / "gallery.css").read_text("utf-8")
    filled = {
        "policy": POLICY.format(script="'none'", style=hash_of(style)),
        "style": style,
        "mark": MARK,
        "count": f"{len(pages)} light field{'' if len(pages) == 1 else 's'}",
        "entries": "\n".join(filter(None, (_entry(folder, page) for page in pages))),
    }
    text = Template((parts / "gallery.html").read_text("utf-8")).substitute(filled)
    with write_file(path) as temporary:
        temporary.write_bytes(text.encode("utf-8", "replace"))
    return path


def _is_ours(path: Path) -> bool:
    return is_file(path) and MARK in read_text(path, 1 << 30)[:4000]


def _entry(folder: Path, page: str) -> str:
    """Of a page; "" where it is gone."""
    try:
        with open(folder / page, "rb") as file:
            start = file.read(MOST_START_BYTES)
    except OSError:
        return ""
    title, first = TITLE.search(start), FIRST.search(start)
    if title is None or first is None:
        return ""
    # Titles and words are escaped in the page as they are here; whether they are, a page changed by hand leaves open.
    words = [html.escape(html.unescape(text.decode("utf-8", "replace"))) for text in (title[1], first[1])]
    link = quote(os.fsencode(page.replace(os.sep, "/")))
    return ENTRY.format(link=html.escape(link), alt=words[1], title=words[0], picture=_thumbnail(first[2]))


def _thumbnail(letters: bytes) -> str:
    from PIL import Image

    with Image.open(BytesIO(base64.b64decode(letters))) as image:
        image.thumbnail((SIDE_PX, SIDE_PX))
        packed = BytesIO()
        image.save(packed, "AVIF", quality=QUALITY, speed=8, icc_profile=image.info.get("icc_profile", b""))
    return "data:image/avif;base64," + base64.b64encode(packed.getvalue()).decode("ascii")
