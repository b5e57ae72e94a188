"""Maps beside a photo, and in the folder of maps beside its folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.maps.map_names import (
    ARRAYS,
    FOLDER_OF_MAPS,
    FOLDER_OF_PHOTOS,
    LIKELY,
    LIKELY_ENDINGS,
    MAP_ENDINGS,
    OF_COLMAP,
    ONLY_MAPS,
    fold,
    map_name,
    photo_keys,
)
from iibr_core.types import InputError

MAX_NAMED = 3
"""Largest number of unused maps that a note names."""


def find_sidecars(photo_path: Path) -> list[Path]:
    """Return all maps of a photo beside it, then those in folders of maps, each the best first."""
    if not photo_path.name:
        return []
    found = [(0, rank, path) for path in _files_in(photo_path.parent) if (rank := _rank(path, photo_path))]
    for place, folder in enumerate(_folders_of_maps(photo_path.parent), 1):
        ranked = ((_rank(path, photo_path, is_folder_of_maps=True), path) for path in _files_in(folder))
        found += [(place, rank, path) for rank, path in ranked if rank]
    return [path for _, _, path in sorted(found)]


def map_to_read(photo_path: Path, choice: DepthChoice) -> Path | None:
    """Return the map that the user names, else the one beside the photo if the search for depth begins there."""
    if choice.file is not None:
        return Path(choice.file)
    return next(iter(find_sidecars(photo_path)), None) if choice.start == "auto" else None


def unused_map_notes(photo_path: Path) -> tuple[str, ...]:
    """Return a note on files beside a photo that look like its depth map and are not used; none without."""
    stem, used = fold(photo_path.stem), find_sidecars(photo_path)
    names = sorted(
        path.name
        for path in _files_in(photo_path.parent)
        if path not in (photo_path, *used) and path.suffix.lower() in LIKELY_ENDINGS and _looks_like_map(path, stem)
    )
    if not names:
        return ()
    listed = ", ".join(names[:MAX_NAMED])
    words = f"Not used, though they may be depth maps of the photo: {listed}."
    return (f"{words} Open one as the depth map, or name it {photo_path.stem}_depth, in a kind of file that is read.",)


def _looks_like_map(path: Path, photo_stem: str) -> bool:
    folded = fold(path.stem)
    is_alone = folded == photo_stem and path.suffix.lower() in ARRAYS
    return is_alone or (folded.startswith(photo_stem) and LIKELY.search(folded, len(photo_stem)) is not None)


def _rank(path: Path, photo_path: Path, is_folder_of_maps: bool = False) -> tuple[int | str, ...]:
    """Return how well a file suits as the map of a photo, the less the better; () if it is none."""
    ending, stem = path.suffix.lower(), path.stem
    if ending not in MAP_ENDINGS or path == photo_path:
        return ()
    keys = photo_keys(photo_path.stem)
    if ending == ".bin":  # COLMAP's, see OF_COLMAP
        name, _, kind = fold(stem).rpartition(".")
        order = OF_COLMAP.index(f".{kind}") if f".{kind}" in OF_COLMAP and name == fold(photo_path.name) else -1
        return (0, order, 0, path.name) if order >= 0 else ()
    said = map_name(stem)
    if said is not None and said.key in keys and not _is_own_export(path, stem):
        order, key = int(said.is_depth), said.key
    elif is_folder_of_maps or ending in ONLY_MAPS:
        order, key = 2, photo_keys(stem)[0]
    else:
        return ()
    return (order, keys.index(key), len(stem), MAP_ENDINGS.index(ending), path.name) if key in keys else ()


def _is_own_export(path: Path, stem: str) -> bool:
    """Return whether a file is named as this program proposes for a disparity map that it exports, edits included."""
    if not stem.lower().endswith("-disparity"):
        return False
    from iibr_core.formats.images.open_picture import open_picture  # help and window come before it
    from iibr_core.formats.maps.writer import KEY, text_from

    try:
        return path.suffix.lower() in (".pfm", ".npy") or text_from(open_picture(path).text(KEY)) is not None
    except InputError:
        return True


def _folders_of_maps(folder: Path) -> list[Path]:
    """Return the folders of maps in a photo's folder, and beside it if that is one of photos, COLMAP's too."""
    places = [folder]
    if FOLDER_OF_PHOTOS.fullmatch(folder.absolute().name):
        places += [folder.absolute().parent, folder.absolute().parent / "stereo"]
    inside = (path for place in places for path in _entries(place) if FOLDER_OF_MAPS.fullmatch(path.name))
    return sorted(path for path in inside if path.is_dir())


def _files_in(folder: Path) -> Iterator[Path]:
    return (path for path in _entries(folder) if path.suffix.lower() in LIKELY_ENDINGS and path.is_file())


def _entries(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError:
        return []
