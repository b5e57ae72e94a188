"""Lay out downloaded scenes for `make bench DATA=DATA` and `make figures DATA=DATA`.

    python -m benchmarks lay-out DOWNLOADS DATA

DOWNLOADS holds what docs/accuracy.md links to: archives as they are, or unpacked folders. Each scene found there
gets a folder in DATA; scenes that DATA has already stay. Sources of scenes that are missing are printed.
"""

from __future__ import annotations

import argparse
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from iibr_core.formats.light_fields.light_field_formats import find_light_field
from iibr_core.formats.outputs import write_folder
from iibr_core.types import InputError

MIDDLEBURY = "https://vision.middlebury.edu/stereo/data"


class Download(NamedTuple):
    """A scene to download. files: regular expression of their paths in the archive. count: number of files needed."""

    name: str
    source: str
    files: str
    count: int


DOWNLOADS = (
    Download(
        "mb2014_motorcycle",
        f"{MIDDLEBURY}/scenes2014/zip/Motorcycle-perfect.zip",
        r"Motorcycle(-perfect)?/(im[01]\.png|disp[01]\.pfm)",
        4,
    ),
    Download(
        "mb2003_teddy_quarter",
        f"{MIDDLEBURY}/scenes2003/newdata/teddy/ (im2, im6, disp2, disp6; in a folder `teddy`)",
        r"teddy/(im|disp)[26]\.png",
        4,
    ),
    Download(
        "mb2005_moebius_third",
        f"{MIDDLEBURY}/scenes2005/ThirdSize/zip-2views/Moebius-2views.zip",
        r"Moebius/(view|disp)[15]\.png",
        4,
    ),
    Download(
        "hci_antinous",
        "https://lightfield-analysis.uni-konstanz.de (additional scenes)",
        r"antinous/(input_Cam\d{3}\.png|gt_disp_lowres\.pfm)",
        82,
    ),
)


def main() -> None:
    """Lay out all scenes that are found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("downloads", type=Path, help="folder of archives and unpacked folders")
    parser.add_argument("data", type=Path, help="folder of scenes to fill")
    options = parser.parse_args()
    if not options.downloads.is_dir():
        raise InputError(f"{options.downloads}: is no folder; give the folder with the downloads")
    found = dict(files_in(options.downloads))
    for scene in DOWNLOADS:
        print(f"{scene.name}: {lay_out(scene, found, options.data / scene.name)}")


def files_in(folder: Path) -> Iterator[tuple[str, zipfile.Path | Path]]:
    """Yield the path and the file of everything in a folder and in its archives."""
    for path in sorted(folder.rglob("*")):
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                names = [name for name in archive.namelist() if not name.endswith("/")]
            yield from ((f"{path.name}/{name}", zipfile.Path(path, name)) for name in names)
        elif path.is_file():
            yield path.relative_to(folder.parent).as_posix(), path


def lay_out(scene: Download, found: dict[str, zipfile.Path | Path], folder: Path) -> str:
    """Copy the files of a scene into its folder. Return the result in words."""
    if folder.exists():
        return "is there already"
    pattern = re.compile(rf"(.*/)?{scene.files}")
    files = {Path(path).name: file for path, file in found.items() if pattern.fullmatch(path)}
    if len(files) < scene.count:
        return f"{len(files)} of {scene.count} files found; get {scene.source}"
    with write_folder(folder) as unfinished:
        for name, file in files.items():
            (unfinished / name).write_bytes(file.read_bytes())
    known = find_light_field(folder)
    assert known is not None
    return f"laid out ({known.layout})"


if __name__ == "__main__":
    main()
