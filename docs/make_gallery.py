"""Makes the pictures of docs/gallery.md by its commands: python docs/make_gallery.py [FOLDER]

Each line of the page that begins with `iibr` is run as it stands, from the root of the source.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

DOCS = Path(__file__).parent
MOST_BYTES = 2_000_000
"""Largest size of a picture in bytes: the page is read over the network."""


def main() -> None:
    """Write the pictures beside those of the page, or into the folder named."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "gallery"
    for words in commands():
        picture = folder / Path(words[-1]).name
        subprocess.run([sys.executable, "-P", "-m", "viewer", *words[1:-1], str(picture), "--force"],
                       cwd=DOCS.parent, check=True)  # fmt: skip
        if picture.stat().st_size >= MOST_BYTES:
            raise SystemExit(f"{picture}: {picture.stat().st_size} bytes; must be less than {MOST_BYTES}")


def commands() -> Iterator[list[str]]:
    """The page's commands, in words; the last word of each is the picture that it writes."""
    for line in (DOCS / "gallery.md").read_text("utf-8").splitlines():
        if line.startswith("iibr "):
            words = shlex.split(line)
            if words[-2] != "-o" or Path(words[-1]).parent != Path("docs/gallery"):
                raise SystemExit(f"{line}: must end in -o docs/gallery/NAME")
            yield words


if __name__ == "__main__":
    main()
