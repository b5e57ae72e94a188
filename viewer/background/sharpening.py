"""Parts of pictures made from the photo at its own size, in a thread; the newest request counts."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.full_picture import FullPicture, encode_light
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.runtime.work import Cancelled
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.types import SRGB
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.background.window_work import WindowWork

if TYPE_CHECKING:
    from iibr_core.beyond.full_size import LargePhoto


@dataclass(frozen=True, eq=False)
class SharpPart:
    """A part of a picture, drawn: (height, width, 3), sRGB-encoded."""

    pixels: NDArray[np.uint8]


SharpResult = SharpPart | Failed[None]
DrawSteps = Callable[[RenderSettings], Generator[None, None, NDArray[Any]]]
"""Draws a tile, in steps, in the window's thread."""


class SharpeningWorker(JobThread[FullPicture, SharpResult]):
    """Keeps the photo: the next part of it is then drawn at once. window_work: has the tiles drawn."""

    def __init__(self, wake: Callable[[], None], draw: DrawSteps) -> None:
        """wake: called, in the thread, when there is something to draw, or a part is drawn."""
        super().__init__("iibr-sharp", wake, self._make, lambda request, message: Failed(None, message))
        self.window_work = WindowWork(wake)
        self._draw_steps = draw
        self._photo: tuple[LoadedPhoto, LargePhoto] | None = None

    def forget(self) -> None:
        """Free the photo."""
        self._photo = None

    def _make(self, job: Job[FullPicture, SharpResult]) -> Iterator[SharpResult]:
        request, kept = job.request, self._photo

        def draw(settings: RenderSettings) -> NDArray[Any]:
            return self.window_work.run(self._draw_steps(settings))

        def keep(photo: LargePhoto) -> None:
            self._photo = request.loaded, photo

        photo = kept[1] if kept is not None and kept[0] is request.loaded else None
        from iibr_core.exports.full_drawing import draw_full

        with suppress(Cancelled):
            light = draw_full(request, draw, photo, keep)
            yield SharpPart(encode_light(light, False, SRGB, request.scene.color_space))
