"""`iibr generate --poses`: what any cameras see of a photo, on disk."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from iibr_core.color import photo_in_srgb
from iibr_core.formats.images.write import write_image
from iibr_core.formats.outputs import check_output_folder, write_folder
from iibr_core.inpainting.registry import load_inpainter
from iibr_core.method.memory import MAKING_BYTES, require_memory
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.scene import MAKING
from iibr_core.types import Camera, FloatImage, InputError
from viewer.cli.shared_options import given_options, require_model
from viewer.cli.terminal import print_depth, print_notes, show_progress

if TYPE_CHECKING:
    from iibr_core.scenes.scene import LoadedPhoto, Source

OWN_FILES = r"view_\d{4,5}\.(png|exr)"
NOT_WITH_POSES = {"format": "--format", "depth_strength": "--depth-strength", "with_disparity": "--with-disparity",
                  "gloss": "--gloss"}  # fmt: skip
"""Parameters of light fields alone. Weights are the closed form's."""
MOSTLY, MOST_NAMED = 0.5, 5
"""Poses whose inpainted share exceeds this are named, so many at most."""


def require_heeded_with_poses(context: typer.Context) -> None:
    """Raise InputError for options that only light fields heed."""
    given = [option for name, option in NOT_WITH_POSES.items() if name in given_options(context)]
    if given:
        raise InputError(f"{' and '.join(given)}: for light fields only; leave it out with --poses")


def require_poses_for(photo_pose: int | None, poses: Path | None) -> None:
    """Raise InputError for the number of a pose where there are none."""
    if photo_pose is not None and poses is None:
        raise InputError("--photo-pose says which of --poses is the photo's: give those, too")


def poses_of(path: Path, photo_pose: int | None) -> tuple[tuple[Camera, ...], int]:
    """Return the cameras of a file, and the index of the photo's.

    photo_pose: number of the photo's camera, from 1, None for the middle one. Raises InputError.
    """
    from iibr_core.formats.poses import central_camera, read_poses

    cameras = read_poses(path)
    if photo_pose is not None and photo_pose > len(cameras):
        raise InputError(f"--photo-pose {photo_pose}: {path} holds {len(cameras)}")
    return cameras, central_camera(cameras) if photo_pose is None else photo_pose - 1


def require_views_folder(out: Path, inputs: Sequence[Path], may_replace: bool) -> None:
    """Raise InputError where the views may not be written. inputs: what is read."""
    check_output_folder(out, inputs, may_replace, OWN_FILES)


def write_free_views(source: Source, poses: Path, photo_pose: int | None, is_literal: bool, out: Path) -> None:
    """A picture for each pose, view_0001.png and so on, in a folder: one that `require_views_folder` admits.
    photo_pose: the number of the photo's, from 1. is_literal: disparity counts in px per unit of length.

    Raises InputError.
    """
    require_model(source.depth)
    cameras, given = poses_of(poses, photo_pose)
    with show_progress("reading"):
        from iibr_core.scenes.photo import load_photo

        loaded = load_photo(source)
    from iibr_core.beyond.free_cameras import fitted_cameras

    pictures = fitted_cameras(cameras, given, loaded.photo.size)
    start, unseen = time.perf_counter(), []
    with show_progress(MAKING):
        for done, share in enumerate(_written(out, source, loaded, is_literal, pictures, given), 1):
            unseen.append(share)
            report_progress(done, len(pictures), MAKING)
    seconds = time.perf_counter() - start
    print(f"{len(pictures)} views in {seconds:.2f} s ({1000 * seconds / len(pictures):.1f} ms per view): {out}")
    notes = (*loaded.photo.notes, *loaded.disparity.notes, f"The photo was taken at {pictures[given].source}.")
    print_notes((*notes, *_unseen_notes(unseen)))
    print_depth(loaded.origin)


def _written(
    out: Path, source: Source, loaded: LoadedPhoto, is_literal: bool, cameras: Sequence[Camera], given: int
) -> Iterator[float]:
    """Write the views, one after the other; of each the share that the photo does not show. The folder is there when
    all have been taken.
    """
    from iibr_core.beyond.free_cameras import FreeViews, depths_of, reach_of
    from iibr_core.method.light_field import encode_for_storage
    from iibr_core.scenes.photo import depth_estimator

    photo, inverse_depth = photo_in_srgb(loaded.photo), _inverse_depth(loaded, is_literal, cameras[given])
    canvas = reach_of(cameras[given], cameras, depths_of(inverse_depth)).margins.around(photo.size)
    largest = max((camera.size for camera in cameras), key=math.prod)
    require_memory(math.prod(canvas) * MAKING_BYTES, f"making views of {largest} from a canvas of {canvas}")
    inpainter = load_inpainter(source.inpaint, depth_estimator(source, loaded))
    views = FreeViews(photo.pixels, inverse_depth, cameras[given], cameras, inpainter=inpainter)
    with write_folder(out) as unfinished:
        for number, camera in enumerate(cameras, 1):
            view = views.view(camera)
            name = f"view_{number:04d}{'.exr' if photo.is_hdr else '.png'}"
            write_image(unfinished / name, encode_for_storage(view.colors, photo.is_hdr))
            yield float(view.inpainted.mean())


def _inverse_depth(loaded: LoadedPhoto, is_literal: bool, camera: Camera) -> FloatImage:
    """1 / depth (H, W) of the photo in the unit of the poses. Raises InputError where disparity does not say it."""
    from iibr_core.beyond.free_cameras import inverse_depth_of

    values = loaded.disparity.values
    if not is_literal:
        return inverse_depth_of(values, camera.depth_range)
    if not values.min() > 0:
        raise InputError(f"{loaded.disparity.source}: holds disparities that are not positive, which --literal needs")
    return values / np.float32(camera.focal_px[0])


def _unseen_notes(unseen: Sequence[float]) -> tuple[str, ...]:
    """A sentence about the poses that show mostly inpainted areas."""
    many = [f"{number} ({share:.0%})" for number, share in enumerate(unseen, 1) if share > MOSTLY]
    if not many:
        return ()
    named = ", ".join(many[:MOST_NAMED]) + (" and others" if len(many) > MOST_NAMED else "")
    return (f"Most of what these poses show was inpainted, as the photo does not show it: {named}.",)
