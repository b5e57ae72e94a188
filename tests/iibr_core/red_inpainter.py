"""A way of inpainting that cannot be overlooked: for tests of the way to it, which put its ENTRY into the registry."""

ENTRY = f"{__name__}:paint_red"


def paint_red(colors, disparity, hole, photo_disparity, offset, threads):
    colors[hole], disparity[hole] = (1.0, 0.0, 0.0), -9.0
