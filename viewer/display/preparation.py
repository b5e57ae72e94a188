"""Programs of the graphics card compiled before they are needed, one a turn of the loop: a frame that draws with a
program for the first time waits for its driver.
"""

from __future__ import annotations

from iibr_core.beyond.optics import Optics
from iibr_core.types import ViewOffset
from viewer.gpu.refocus.picture_drawing import PictureDrawing
from viewer.gpu.refocus.picture_renderer import PREPARED_SIZE, Renderer
from viewer.model.state.app_state import Picture

FIRST = Optics()
"""What is drawn of any photo, with whatever is open."""

NEXT = (Optics(ViewOffset(0.2, 0.3), aperture_diameter=3.0), Optics(ViewOffset(0.2, 0.3), aperture_diameter=1.5))
"""What is likely to be drawn next, with all views."""


class Preparation:
    """Compiles a program each time there is nothing else to do."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        self._left = [FIRST, *NEXT]
        self._drawing: PictureDrawing | None = None

    def advance(self, picture: Picture | None, is_resting: bool) -> bool:
        """Have one more compiled; whether another can follow. picture: that is shown, None before anything is open.
        is_resting: it has all views and stays.
        """
        if not self._left or not (self._left[0] is FIRST if picture is None else is_resting):
            return False
        if self._drawing is None:
            size_px = PREPARED_SIZE if picture is None else picture.size_px
            self._drawing = self._renderer.start_preparing(self._left[0], size_px)
        self._drawing.advance(0.0)
        if self._drawing.is_done:
            self.release()
            self._left.pop(0)
        return True

    def release(self) -> None:
        """Free what is being drawn with."""
        if self._drawing is not None:
            self._drawing.stop()
            self._drawing = None
