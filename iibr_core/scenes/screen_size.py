"""Sizes of pictures, as graphics cards and windows give them."""

from typing import NamedTuple


class ScreenSize(NamedTuple):
    """Width and height in pixels: the order of GL, GLFW and ImGui. Images have an `ImageSize`."""

    width: int
    height: int
