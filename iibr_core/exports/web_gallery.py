"""A page that lists the web pages of a batch, with the first picture and the title of each. It needs no server."""

import base64
import html
import os
import re
from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from string import Template
from urllib.parse import quote

from PIL import Image

from iibr_core.exports.web import POLICY, hash_of
from iibr_core.formats.files import read_text
from iibr_core.formats.outputs import write_file
from iibr_core.runtime.resources import resource_folder
from iibr_core.types import InputError

NAME, OTHER_NAME = "index.html", "index-of-pages.html"
"""Name of the gallery, and its name if a photo's page is called index.html."""
MARK = "iibr gallery"
SIDE_PX, QUALITY = 480, 70
MAX_START_BYTES = 8_000_000
"""Number of bytes read of each page, enough for its first picture."""
FIRST = re.compile(rb'<img id="first" alt="([^"]*)" src="data:[\w/]+;base64,([A-Za-z0-9+/=]+)"')
TITLE = re.compile(rb"<title>([^<]*)</title>")
ENTRY = '<li><a href="{link}"><img alt="{alt}" src="{picture}"><span>{title}</span></a></li>'


def write_gallery(folder: Path, outputs: Iterable[str]) -> Path:
    """Write the gallery of the pages with these names in the folder; return its path."""
    pages = sorted(outputs)
    path = folder / (NAME if NAME not in pages else OTHER_NAME)
    if os.path.lexists(path) and not (path.is_file() and MARK in read_text(path, 1 << 30)[:4000]):
        raise InputError(f"{path}: already exists and is no gallery; move it, for the index of these pages goes there")
    parts = resource_folder("web")
    style = (parts / "gallery.css").read_text("utf-8")
    fields = {
        "policy": POLICY.format(script="'none'", style=hash_of(style)),
        "style": style,
        "mark": MARK,
        "count": f"{len(pages)} light field{'' if len(pages) == 1 else 's'}",
        "entries": "\n".join(filter(None, (_entry(folder, page) for page in pages))),
    }
    text = Template((parts / "gallery.html").read_text("utf-8")).substitute(fields)
    with write_file(path) as temporary:
        temporary.write_bytes(text.encode("utf-8", "replace"))
    return path


def _entry(folder: Path, page: str) -> str:
    """Return the HTML of a page's entry, "" if the page is missing or has no picture."""
    try:
        with open(folder / page, "rb") as file:
            start = file.read(MAX_START_BYTES)
    except OSError:
        return ""
    title, first = TITLE.search(start), FIRST.search(start)
    if title is None or first is None:
        return ""
    # The texts are escaped in our pages; a page that was edited by hand may contain anything.
    words = [html.escape(html.unescape(text.decode("utf-8", "replace"))) for text in (title[1], first[1])]
    link = quote(os.fsencode(page.replace(os.sep, "/")))
    return ENTRY.format(link=html.escape(link), alt=words[1], title=words[0], picture=_thumbnail(first[2]))


def _thumbnail(encoded: bytes) -> str:
    with Image.open(BytesIO(base64.b64decode(encoded))) as image:
        image.thumbnail((SIDE_PX, SIDE_PX))
        packed = BytesIO()
        image.save(packed, "AVIF", quality=QUALITY, speed=8, icc_profile=image.info.get("icc_profile", b""))
    return "data:image/avif;base64," + base64.b64encode(packed.getvalue()).decode("ascii")
