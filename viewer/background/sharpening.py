"""Parts of pictures drawn from the photo at its own size, in a thread; the newest request counts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports import FullPicture, encode_light
from iibr_core.runtime import Cancelled
from iibr_core.scenes import LoadedPhoto
from iibr_core.types import SRGB
from viewer.background.job_threads import Failed, Job, JobThread

if TYPE_CHECKING:
    from iibr_core.rendering import LargePhoto


@dataclass(frozen=True, eq=False)
class SharpPart:
    """A part of a picture, drawn: (height, width, 3), sRGB-encoded."""

    pixels: NDArray[np.uint8]


SharpResult = SharpPart | Failed[None]


class SharpeningWorker(JobThread[FullPicture, SharpResult]):
    """The photo is kept: the next part of it is then drawn at once."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when a part is drawn."""
        super().__init__("iibr-sharp", wake, self._draw, lambda request, message: Failed(None, message))
        self._photo: tuple[LoadedPhoto, LargePhoto] | None = None

    def forget(self) -> None:
        """Free the photo."""
        self._photo = None

    def _draw(self, job: Job[FullPicture, SharpResult]) -> Iterator[SharpResult]:
        request, kept = job.request, self._photo
        with suppress(Cancelled):
            photo = kept[1] if kept is not None and kept[0] is request.loaded else request.load(job.should_stop)
            self._photo = request.loaded, photo
            if request.needs_fills and photo.fills is None:
                photo = photo.with_fills(request.fill(job.should_stop))
                self._photo = request.loaded, photo
            light = request.draw_from(photo, job.should_stop)
            yield SharpPart(encode_light(light, False, SRGB, request.scene.color_space, job.should_stop))
