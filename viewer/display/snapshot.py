"""A scene at one moment, for jobs that outlive it: the window may show another scene by then."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from iibr_core.scenes.scene import LoadedPhoto, Scene, SceneReady, ViewReady
from iibr_core.types import ViewUpdate
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture

if TYPE_CHECKING:
    from iibr_core.gloss.shading import GlossMaps


@dataclass(eq=False)
class SceneSnapshot:
    """A scene and its views.

    loaded: None for a light field from disk. field: the views, held until `release`, which is for the window's thread.
    gloss: maps of the glossy surface, None if not known. is_free_view: the field is the view of a free camera.
    """

    scene: Scene
    loaded: LoadedPhoto | None
    centre: ViewUpdate
    field: LightFieldTexture
    gloss: GlossMaps | None = None
    is_free_view: bool = False

    def add(self, made: ViewReady) -> None:
        """Store a view of the scene."""
        view = made.view
        if (view.row, view.column) != self.scene.grid.centre:
            self.field.upload(view.row, view.column, view.colors, view.disparity)
        if made.hidden is not None:
            self.field.set_hidden(made.hidden)

    def take_gloss(self, maps: GlossMaps) -> None:
        """Draw gloss with these maps from now on."""
        self.field.set_gloss(maps)
        self.gloss = maps

    def release(self) -> None:
        """Release the views."""
        self.field.release()


def field_of(gl: GLContext, scene: Scene, is_single: bool = False) -> LightFieldTexture:
    """Return an empty field for a scene's views, or for one of them. Raises InputError if the driver cannot hold it."""
    size = scene.width, scene.height, scene.is_hdr, scene.has_view_disparity
    field = LightFieldTexture(gl.ctx, scene.grid, *size, is_single)
    field.color_space, field.row_step = scene.color_space, scene.row_step
    return field


def snapshot_of(gl: GLContext, ready: SceneReady) -> SceneSnapshot:
    """Return a snapshot of a scene that is not shown, with its centre view; the caller stores the other views.

    Raises InputError if it does not fit the graphics card.
    """
    centre, field = ready.centre, field_of(gl, ready.scene)
    field.upload(*field.grid.centre, centre.colors, centre.disparity)
    return SceneSnapshot(ready.scene, ready.loaded, centre, field)
