"""Light fields whose every view is known exactly: a textured background and a disc before it, each at one disparity."""

from dataclasses import dataclass

import numpy as np

from iibr_core.beyond.aperture_shape import opening
from iibr_core.beyond.hidden_surfaces import SeenBehind, hidden_surface
from iibr_core.color import encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.method.farthest_views import outer_views_of_grid
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from viewer.gpu.light_field_texture import LightFieldTexture


@dataclass(frozen=True)
class TwoPlanes:
    """background, foreground: disparities of wall and disc, px per view step. Colours are smooth, the edge is hard.

    across, down: the disc's place in the middle view, as shares of its size.
    """

    width: int = 96
    height: int = 72
    background: float = -1.0
    foreground: float = 2.0
    radius_px: float = 18.0
    contrast: float = 0.2
    across: float = 0.5
    down: float = 0.5

    def view(self, eye):
        """Colours (H, W, 3) and disparity (H, W) seen from an eye, pixel centres only."""
        y, x = np.indices((self.height, self.width)).astype(float)
        colors, disparity = self.seen(x, y, eye.t, eye.s)
        return np.rint(colors * 255).astype(np.uint8), disparity

    def seen(self, x, y, t, s):
        """Colours and disparity at real places of the picture of a camera at (t, s); each place may have its own."""
        far = self._texture(x + self.background * s, y + self.background * t, hue=0.0)
        near = self._texture(x + self.foreground * s, y + self.foreground * t, hue=2.0)
        centre_x = self.across * self.width - self.foreground * s
        centre_y = self.down * self.height - self.foreground * t
        in_front = np.hypot(x - centre_x, y - centre_y) < self.radius_px
        disparity = np.where(in_front, self.foreground, self.background).astype(np.float32)
        return np.where(in_front[..., None], near, far), disparity

    def _texture(self, x, y, hue):
        waves = [np.sin(0.31 * x + 0.17 * y + hue), np.sin(0.11 * x - 0.29 * y + 2 * hue), np.sin(0.23 * y + hue)]
        return 0.5 + self.contrast * np.stack(waves, axis=-1) + 0.1 * np.cos(hue)

    def open(self, renderer, grid, with_disparity=True, row_step=1.0):
        """Open an empty field of this scene's size. row_step: distance of rows, in columns."""
        size = self.width, self.height
        open_field(renderer, grid, *size, hdr=False, with_disparity=with_disparity, row_step=row_step)

    def upload(self, renderer, grid, row, column, with_disparity=True):
        """Upload one view."""
        t, s = grid.offset(row, column)
        colors, disparity = self.view(ViewOffset(renderer.field.row_step * t, s))
        renderer.field.upload(row, column, colors, disparity if with_disparity else None)

    def fill(self, renderer, grid, with_disparity=True, row_step=1.0):
        """Open the field and upload every view, and the surface behind the centre view's as the outer views show it."""
        self.open(renderer, grid, with_disparity, row_step)
        for at in np.ndindex(*grid):
            self.upload(renderer, grid, *at, with_disparity)
        if with_disparity:
            outer = [ViewOffset(row_step * at.t, at.s) for at in outer_views_of_grid(grid)]
            seen = [SeenBehind(at, *self.view(at), None) for at in outer]
            colors, disparity = self.view(ViewOffset(0.0, 0.0))
            renderer.field.set_hidden(hidden_surface(encoded_from_stored(colors), disparity, max(grid), seen))


def through_lens(scene, optics, across=24):
    """The picture by brute force: the mean, in linear light, of cameras `across` the opening in each direction, each
    seeing the scene itself.
    """
    y, x = np.indices((scene.height, scene.width)).astype(float)
    t, s = eyes_of_pixels(optics, scene)
    focus, total, weights = focus_of_pixels(optics, scene), np.zeros((scene.height, scene.width, 3)), 0.0
    for (dt, ds), weight in zip(*camera_grid(optics, across)):
        colors, _ = scene.seen(x - focus * ds, y - focus * dt, t + dt, s + ds)
        left = weight * barrel_share(optics, scene, dt, ds)[..., None]
        total += left * linear_from_srgb(colors)
        weights += left
    return np.rint(np.clip(srgb_from_linear(total / weights), 0, 1) * 255).astype(np.uint8)


def camera_grid(optics, across):
    """Places (N, 2) all over the opening, (t, s) from its middle, and how open it is there."""
    diameter = optics.aperture_diameter
    places = diameter * ((np.arange(across) + 0.5) / across - 0.5)
    t, s = (axis.ravel() for axis in np.meshgrid(places, places, indexing="ij"))
    weights = opening(optics.aperture_shape, t, s, diameter, diameter / across)
    return np.stack([t, s], -1)[weights > 0], weights[weights > 0]


def eyes_of_pixels(optics, scene):
    """(t, s) at which each pixel's ray crosses the grid."""
    right, lower = from_middle(scene)
    aspect = scene.height / scene.width
    return optics.eye.t - optics.dolly * lower * aspect, optics.eye.s - optics.dolly * right


def focus_of_pixels(optics, scene):
    """The sharp disparity of each pixel."""
    right, lower = from_middle(scene)
    return optics.focus_disparity + optics.focus_tilt[0] * right + optics.focus_tilt[1] * lower


def barrel_share(optics, scene, dt, ds):
    """1 where the barrel lets light through this place of the lens; in the corners it has moved by `cat_eye` radii."""
    shape, radius = optics.aperture_shape, optics.aperture_diameter / 2
    if shape.kind != "cat_eye":
        return np.ones((scene.height, scene.width))
    right, lower = from_middle(scene)
    by = radius * shape.cat_eye / np.hypot(scene.width, scene.height)
    return (np.hypot(dt - by * scene.height * lower, ds - by * scene.width * right) < radius).astype(float)


def from_middle(scene):
    """Each pixel's place, -1 at the left and the upper border, 1 at the right and the lower one."""
    y, x = np.indices((scene.height, scene.width)) + 0.5
    return 2 * x / scene.width - 1, 2 * y / scene.height - 1


def settled(renderer, optics, scene):
    """The picture with every camera that it gets."""
    return renderer.converged_picture(RenderSettings(optics, ScreenSize(scene.width, scene.height)))


def first_frame(renderer, optics, scene):
    """The picture that is drawn at once."""
    renderer.render(optics, ScreenSize(scene.width, scene.height))
    return renderer.read_image()


def open_field(renderer, grid, width, height, hdr=False, with_disparity=True, row_step=1.0):
    """Let a renderer draw an empty field of this size."""
    field = LightFieldTexture(renderer.ctx, grid, width, height, hdr, with_disparity)
    field.row_step = row_step
    if renderer.field is not None:
        renderer.field.release()
    renderer.show(field)


def open_views(renderer, grid, colors, disparity):
    """Open a field whose views all have these colours (H, W, 3) and this disparity."""
    height, width = colors.shape[:2]
    open_field(renderer, grid, width, height)
    for at in np.ndindex(*grid):
        renderer.field.upload(*at, colors, np.full((height, width), disparity, np.float32))


def rms(image, expected, border=8):
    """Root mean square difference inside the border, 1 = white."""
    inside = slice(border, -border)
    difference = image[inside, inside].astype(float) - expected[inside, inside]
    return float(np.sqrt(np.mean(difference**2)) / 255)


def psnr(image, expected, border=8):
    """Likeness inside the border, dB."""
    return float(-20 * np.log10(max(rms(image, expected, border), 1e-9)))
