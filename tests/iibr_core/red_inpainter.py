"""A way of inpainting that cannot be overlooked: for tests of the way to it, which put its ENTRY into the registry."""

ENTRY = f"{__name__}:red_inpainter"


def red_inpainter():
    """The factory that the registry asks for."""
    return paint_red


def paint_red(colors, disparity, hole, photo_disparity, offset, threads):
    """Everything red, far behind."""
    colors[hole], disparity[hole] = (1.0, 0.0, 0.0), -9.0
