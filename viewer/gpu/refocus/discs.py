"""Blurs a pinhole's picture as an open lens does: slices of defocus, each with its own disc, composited near to far.

What the pinhole does not see comes from the field's hidden surface. Slices are drawn in tiles, in textures that do not
grow with the picture.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.lens_slices import MAX_SLICES, MAX_TAPS, Slice
from iibr_core.scenes.screen_size import ScreenSize
from viewer.gpu.light_field_texture import LightFieldTexture, box_around
from viewer.gpu.programs import Program, ProgramCache
from viewer.gpu.refocus.picture_lens import BARREL_EDGE, Lens, grown
from viewer.gpu.render_targets import clear

TILE_PX = 512
"""Side of a tile in pixels."""
MAX_ATLAS_PX = 8192
"""Largest height of the texture that holds all slices of a tile, in pixels."""
BLOCK_PX, MAX_REACH_BLOCKS = 16, 12
"""Side of the blocks whose slices are known, in pixels of the picture, and the farthest that light comes, in blocks."""
ALIGNED_PX = 4
"""Software GL draws squares of so many pixels: blocks that lie on them cost least."""
BINS = 128
"""Number of ranges of defocus whose slices are looked up, as in shaders/occupancy.frag."""
SURFACES = ("FRINGE", "", "BEHIND")
"""Switches of shaders/surfaces.frag, one below the other in the textures."""
Box = tuple[int, int, int, int]
"""Left, top, right and bottom of a tile, in pixels of the picture."""
PINHOLE, SEEN, HIDDEN, HIDDEN_DISPARITY, SURFACE, DEFOCUS, BLOCKS, ATLAS = range(8)
"""Texture units."""


@dataclass(frozen=True)
class _Place:
    """A slice of a tile in the textures. source, target: first pixel (x, y) of the slice, and of its blurred picture.

    size, blurred_size: (width, height) of both. origin: first pixel of the slice in the surfaces, px of the picture.
    pad: pixels of the slice around the blurred picture.
    """

    index: int
    slice: Slice
    source: tuple[int, int]
    target: tuple[int, int]
    size: tuple[int, int]
    blurred_size: tuple[int, int]
    origin: tuple[int, int]
    pad: int

    @property
    def texel(self) -> int:
        """Side of a pixel of the slice, px of the picture."""
        return 1 << self.slice.level

    @property
    def first(self) -> tuple[int, int]:
        """First pixel (x, y) of the blurred picture in the surfaces."""
        return self.origin[0] + self.pad * self.texel, self.origin[1] + self.pad * self.texel


@dataclass(frozen=True)
class _Target:
    """A part of a framebuffer. corner: first pixel (x, y). size: (width, height). origin: of the first pixel in the
    surfaces, px. texel: side of a pixel, px of the surfaces.
    """

    corner: tuple[int, int]
    size: tuple[int, int]
    origin: tuple[int, int]
    texel: int


@dataclass(frozen=True)
class _Picture:
    """A picture through a lens. target: takes it. block_px: side of its blocks. reached: slices whose light comes into
    each block of the picture and its margin, a bit for each.
    """

    lens: Lens
    target: moderngl.Framebuffer
    block_px: int
    reached: NDArray[np.uint32]


class Discs:
    """Draws pictures through open lenses. Call it only from the thread of its context."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx, self._programs = ctx, programs
        self._taps = ctx.buffer(reserve=MAX_SLICES * MAX_TAPS * 16)
        self._textures: dict[str, Any] = {}
        self._framebuffers: dict[tuple[str, ...], Any] = {}

    def release(self) -> None:
        """Free every GL object but the programs."""
        self._taps.release()
        for name in list(self._textures):
            self._forget(name)

    def steps(
        self,
        field: LightFieldTexture,
        lens: Lens,
        pinhole: moderngl.Texture,
        seen: moderngl.Texture,
        target: moderngl.Framebuffer,
    ) -> Iterator[None]:
        """Draw the picture through a lens into a target, whose size is the picture's, a tile a step.

        pinhole, seen: light and disparity of the picture and `lens.margin_px` around it.
        """
        self._ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._ctx.enable(moderngl.PROGRAM_POINT_SIZE)
        region, size_px = ScreenSize(*pinhole.size), ScreenSize(*target.size)
        self._write_taps(lens)
        self._draw_surfaces(field, lens, pinhole, seen, region)
        block_px, aspect = _block_px(lens.slices), field.height / field.width
        picture = _Picture(lens, target, block_px, self._draw_occupancy(lens, region, block_px))
        for top, left in itertools.product(range(0, size_px.height, TILE_PX), range(0, size_px.width, TILE_PX)):
            box = left, top, min(left + TILE_PX, size_px.width), min(top + TILE_PX, size_px.height)
            self._ctx.disable(moderngl.BLEND)
            self._draw_tile(picture, box, aspect)
            yield

    def _draw_surfaces(
        self,
        field: LightFieldTexture,
        lens: Lens,
        pinhole: moderngl.Texture,
        seen: moderngl.Texture,
        region: ScreenSize,
    ) -> None:
        width, height = region
        self._texture("light", (width, len(SURFACES) * height), 4, "f2")
        self._texture("defocus", (width, len(SURFACES) * height), 1, "f4")
        framebuffer = self._framebuffer("light", "defocus")
        clear(framebuffer)
        for unit, texture in ((PINHOLE, pinhole), (SEEN, seen)):
            texture.use(unit)
        part = grown(lens.part, lens.margin_px, ScreenSize(width - 2 * lens.margin_px, height - 2 * lens.margin_px))
        hidden = field.hidden
        for i, switch in enumerate(SURFACES):
            if switch == "BEHIND" and hidden is None:
                continue
            program = self._programs.get("surfaces.frag", {switch: bool(switch), "HIGHLIGHTS": lens.highlight_gain > 0})
            framebuffer.viewport = 0, i * height, width, height
            framebuffer.use()
            program.set_uniforms(
                pinhole=PINHOLE,
                seen=SEEN,
                top=i * height,
                part=part,
                disc_px=lens.disc_px,
                texel_px=lens.texel_px,
                highlight_gain=lens.highlight_gain,
                focus_disparity=lens.optics.focus_disparity,
                focus_tilt=lens.optics.focus_tilt,
                focus_range=max(lens.optics.focus_range, 0.0),
            )
            if switch == "BEHIND" and hidden is not None:
                hidden.use(program, HIDDEN, HIDDEN_DISPARITY)
                program.set_uniforms(dolly=lens.dolly, behind_eye=lens.behind_eye, hidden_scale=lens.hidden_scale)
            program.draw()

    def _draw_occupancy(self, lens: Lens, region: ScreenSize, block_px: int) -> NDArray[np.uint32]:
        """Draw the slices that each block has, and return those whose light comes into it, a bit for each."""
        size = -(-region.width // block_px), -(-region.height // block_px)
        self._texture("occupancy", size, 1, "u4")
        self._framebuffer("occupancy").use()
        near, far = lens.slices[0].diameter_px, lens.slices[-1].diameter_px
        scale = (BINS - 2) / max(near - far, 1e-6)
        edges = np.arange(BINS + 1)[:, None] - 1.0  # the first and the last bin are open
        tents = np.array(_tents(lens.slices))
        low, high = (tents[:, 0] - far) * scale, (tents[:, 2] - far) * scale
        meets = (edges[1:] + 0.01 > low) & (edges[:-1] - 0.01 < high)
        bins = (meets * (1 << np.arange(len(tents), dtype=np.uint64))).sum(axis=1)
        program = self._programs.get("occupancy.frag")
        self._use_surfaces(program, region)
        program.set_uniforms(bins=[int(each) for each in bins], bin_of=(scale, 1 - far * scale), block_px=block_px)
        program.draw()
        self._texture("reach", size, 1, "u4")
        self._framebuffer("reach").use()
        self._textures["occupancy"].use(BLOCKS)
        program = self._programs.get("reach.frag")
        reach_px = [_reach_px(each) for each in lens.slices]
        wanted = [
            sum(1 << i for i, each in enumerate(reach_px) if each > away * block_px) for away in range(MAX_REACH_BLOCKS)
        ]
        program.set_uniforms(occupancy=BLOCKS, wanted=wanted, reach=math.ceil(max(reach_px) / block_px))
        program.draw()
        return np.frombuffer(self._textures["reach"].read(), np.uint32).reshape(size[::-1])

    def _draw_tile(self, picture: _Picture, box: Box, aspect: float) -> None:
        """Draw a tile. aspect: height / width of the field."""
        places, sheet, blurred_sheet = _places(picture, box)
        self._texture("slices", sheet, 4, "f2")
        self._texture("blurred", blurred_sheet, 4, "f2")
        self._textures["occupancy"].use(BLOCKS)
        self._draw_slices(picture, places)
        self._textures["reach"].use(BLOCKS)
        self._blur_slices(picture, places, aspect)
        self._composite(picture, places, box)

    def _draw_slices(self, picture: _Picture, places: list[_Place]) -> None:
        framebuffer, tents = self._framebuffer("slices"), _tents(picture.lens.slices)
        clear(framebuffer)
        program = self._programs.get("slice.frag", vertex="blocks.vert")
        width, height = self._textures["light"].size
        self._use_surfaces(program, ScreenSize(width, height // len(SURFACES)))
        for place in places:
            program.set_uniforms(tent=tents[place.index], origin=place.origin, corner=place.source, texel=place.texel)
            target = _Target(place.source, place.size, place.origin, place.texel)
            self._draw_blocks(program, framebuffer, target, 1 << place.index, picture.block_px)

    def _blur_slices(self, picture: _Picture, places: list[_Place], aspect: float) -> None:
        lens, framebuffer = picture.lens, self._framebuffer("blurred")
        is_cat_eye = lens.optics.aperture_shape.kind == "cat_eye"
        clear(framebuffer)
        program = self._programs.get("disc.frag", {"CAT_EYE": is_cat_eye}, vertex="blocks.vert")
        self._textures["slices"].use(ATLAS)
        program.set_uniforms(atlas=ATLAS)
        for place in places:
            program.use_block("Taps", self._taps, place.index * MAX_TAPS * 16, MAX_TAPS * 16)
            shift = tuple(place.source[i] + place.pad - place.target[i] for i in (0, 1))
            program.set_uniforms(tap_count=len(place.slice.taps), shift=shift)
            if is_cat_eye:
                whole = aspect * lens.field_part.width / lens.field_part.height
                _set_barrel(program, lens, place, ScreenSize(*picture.target.size), whole)
            blurred = _Target(place.target, place.blurred_size, place.first, place.texel)
            self._draw_blocks(program, framebuffer, blurred, 1 << place.index, picture.block_px)

    def _composite(self, picture: _Picture, places: list[_Place], box: Box) -> None:
        left, top, right, bottom = box
        program, margin = self._programs.get("composite.frag", vertex="blocks.vert"), picture.lens.margin_px
        self._textures["blurred"].use(ATLAS)
        table = [(0.0, 0.0, 0.0, 0.0)] * MAX_SLICES
        for place in places:
            x, y = (place.target[i] + (margin - place.first[i]) / place.texel for i in (0, 1))
            table[place.index] = (x, y, 1 / place.texel, 0.0)
        program.set_uniforms(atlas=ATLAS, places=table)
        target = _Target((left, top), (right - left, bottom - top), (left + margin, top + margin), 1)
        wanted = (1 << len(picture.lens.slices)) - 1
        self._draw_blocks(program, picture.target, target, wanted, picture.block_px)

    def _draw_blocks(
        self,
        program: Program,
        framebuffer: moderngl.Framebuffer,
        target: _Target,
        wanted: int,
        block_px: int,
    ) -> None:
        """Draw the blocks of a target that have some of the wanted slices, a bit for each, see shaders/blocks.vert."""
        (width, height), texel, point_blocks = framebuffer.size, target.texel, _point_blocks(target.texel, block_px)
        point_px = point_blocks * block_px
        first = [target.origin[i] // point_px for i in (0, 1)]
        last = [math.ceil((target.origin[i] + target.size[i] * texel) / point_px) for i in (0, 1)]
        across, down = (last[i] - first[i] for i in (0, 1))
        x, y = (target.corner[i] - (target.origin[i] - first[i] * point_px) // texel for i in (0, 1))
        side = point_px // texel
        framebuffer.viewport = x, y, across * side, down * side
        framebuffer.scissor = *target.corner, *target.size
        framebuffer.use()
        program.set_uniforms(
            occupancy=BLOCKS,
            wanted=wanted,
            points=(*first, across, down),
            point_blocks=point_blocks,
            point_px=float(side),
        )
        program.draw_points(across * down)
        framebuffer.viewport = framebuffer.scissor = 0, 0, width, height

    def _use_surfaces(self, program: Program, region: ScreenSize) -> None:
        self._textures["light"].use(SURFACE)
        self._textures["defocus"].use(DEFOCUS)
        program.set_uniforms(surfaces=SURFACE, defocus=DEFOCUS, area=tuple(region))

    def _write_taps(self, lens: Lens) -> None:
        table = np.zeros((MAX_SLICES, MAX_TAPS, 4), np.float32)
        for row, each in zip(table, lens.slices):
            row[: len(each.taps), :3] = each.taps
        self._taps.write(table.tobytes())

    def _texture(self, name: str, size: tuple[int, int], components: int, dtype: str) -> Any:
        """Return the texture of this name, another one if its size has changed."""
        texture = self._textures.get(name)
        if texture is None or texture.size != tuple(size):
            if texture is not None:
                self._forget(name)
            texture = self._ctx.texture(size, components, dtype=dtype)
            texture.filter = (moderngl.LINEAR if name in ("slices", "blurred") else moderngl.NEAREST,) * 2
            texture.repeat_x = texture.repeat_y = False
            self._textures[name] = texture
        return texture

    def _framebuffer(self, *names: str) -> Any:
        """Return the framebuffer of these textures."""
        if names not in self._framebuffers:
            self._framebuffers[names] = self._ctx.framebuffer([self._textures[name] for name in names])
        return self._framebuffers[names]

    def _forget(self, name: str) -> None:
        """Free a texture and its framebuffers. Afterwards the screen is bound, see `RenderTarget.release`."""
        self._ctx.detect_framebuffer(0).use()
        for names in [names for names in self._framebuffers if name in names]:
            self._framebuffers.pop(names).release()
        self._textures.pop(name).release()


def _reach_px(each: Slice) -> float:
    """Return the distance from which light of a slice comes when it is enlarged, in pixels."""
    return each.reach_px + 2.0**each.level


def _set_barrel(program: Program, lens: Lens, place: _Place, size_px: ScreenSize, aspect: float) -> None:
    """Set the uniforms of a cat's-eye, see shaders/disc.frag. aspect: height / width of the whole picture."""
    texel, radius = place.texel, max(abs(place.slice.diameter_px) / 2 / place.texel, 1e-6)
    across, down = lens.part.width / size_px.width, lens.part.height / size_px.height
    left, top = (place.first[i] - lens.margin_px - place.target[i] * texel for i in (0, 1))
    program.set_uniforms(
        barrel=lens.barrel(aspect),
        lens_of_px=math.copysign(1 / radius, place.slice.diameter_px),
        barrel_edge=max(2 * BARREL_EDGE, 1 / radius),
        uv_of_px=(lens.part.x + left * across, lens.part.y + top * down, texel * across, texel * down),
    )


def _block_px(slices: tuple[Slice, ...]) -> int:
    """Return the side of blocks for which light comes from at most MAX_REACH_BLOCKS away."""
    farthest, block_px = max(map(_reach_px, slices)), max(BLOCK_PX, max(1 << each.level for each in slices))
    while farthest > MAX_REACH_BLOCKS * block_px:
        block_px *= 2
    return block_px


def _tents(slices: tuple[Slice, ...]) -> list[tuple[float, float, float, float]]:
    """Return lower end, 1 / width, upper end, 1 / width of the weights of each slice; the outermost ones are open."""
    middles = [1e6, *(each.diameter_px for each in slices), -1e6]
    tents = []
    for i in range(1, len(middles) - 1):
        near, here, far = middles[i - 1 : i + 2]
        tents.append((far, 1 / (here - far), near, 1 / (near - here)))
    tents[0] = (*tents[0][:2], 2e6, 1.0)
    tents[-1] = (-2e6, 1.0, *tents[-1][2:]) if len(tents) > 1 else (-2e6, 1.0, 2e6, 1.0)
    return tents


def _places(picture: _Picture, box: Box) -> tuple[list[_Place], tuple[int, int], tuple[int, int]]:
    """Return the places of the slices that a tile shows, and the sizes of both textures."""
    lens, block_px = picture.lens, picture.block_px
    shelves, blurred_shelves, places = _Shelves(), _Shelves(), []
    left, top, right, bottom = (each + lens.margin_px for each in box)
    first = left // block_px, top // block_px
    tile = picture.reached[first[1] : -(-bottom // block_px), first[0] : -(-right // block_px)]
    for index, each in enumerate(lens.slices):
        there = (tile >> index & 1).astype(bool)
        if not there.any():
            continue
        texel = 1 << each.level
        beside, unit = texel if each.level else 0, _point_blocks(texel, block_px) * block_px
        ends = box_around(there)[::-1]
        low = [((first[i] + ends[i].start) * block_px - beside) // unit for i in (0, 1)]
        high = [-((-(first[i] + ends[i].stop) * block_px - beside) // unit) for i in (0, 1)]
        pad = math.ceil(each.reach_px / unit)
        blurred, size = ([(high[i] - low[i] + 2 * extra) * unit // texel for i in (0, 1)] for extra in (0, pad))
        places.append(
            _Place(
                index,
                each,
                shelves.add(*size),
                blurred_shelves.add(*blurred),
                (size[0], size[1]),
                (blurred[0], blurred[1]),
                ((low[0] - pad) * unit, (low[1] - pad) * unit),
                pad * unit // texel,
            )
        )
    return places, shelves.size, blurred_shelves.size


def _point_blocks(texel: int, block_px: int) -> int:
    """Return the side of a point in blocks, so that it has ALIGNED_PX pixels at least."""
    return max(ALIGNED_PX * texel // block_px, 1)


class _Shelves:
    """Places rectangles below each other, in columns, on whole multiples of ALIGNED_PX. size: of all together."""

    def __init__(self) -> None:
        self._left, self._width, self._top, self._height = 0, 0, 0, 0

    def add(self, width: int, height: int) -> tuple[int, int]:
        """Return the corner (x, y) of another rectangle."""
        if self._top + height > MAX_ATLAS_PX:
            self._left, self._width, self._top = self._left + -(-self._width // ALIGNED_PX) * ALIGNED_PX, 0, 0
        corner = self._left, self._top
        self._top += -(-height // ALIGNED_PX) * ALIGNED_PX
        self._width, self._height = max(self._width, width), max(self._height, self._top)
        return corner

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of all rectangles, in steps that many tiles share."""
        return -(-(self._left + self._width) // 64) * 64, -(-self._height // 256) * 256
