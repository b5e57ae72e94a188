"""What is open at one moment, held for work that goes on after it: the window may show another scene by then."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.scenes.scene import LoadedPhoto, Scene, SceneReady
from iibr_core.scenes.scene_gloss import GlossFound
from iibr_core.types import ViewUpdate
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture, field_that_fits


@dataclass(eq=False)
class SceneSnapshot:
    """loaded: None for a light field from disk. field: its views, held until `release`. gloss: of the field, None
    where none is known. is_free_view: the field is the view of a free camera.
    """

    scene: Scene
    loaded: LoadedPhoto | None
    centre: ViewUpdate
    field: LightFieldTexture
    gloss: GlossFound | None = None
    is_free_view: bool = False

    def take_gloss(self, found: GlossFound) -> None:
        """Have it drawn with this gloss from now on."""
        self.field.set_gloss(found.maps)
        self.gloss = found

    def release(self) -> None:
        """Let the views go. Only in the thread of the window."""
        self.field.release()


def snapshot_of(gl: GLContext, ready: SceneReady) -> SceneSnapshot:
    """A scene that is not shown, with its centre view; the others are to be stored in its field.

    Raises InputError where it does not fit the graphics card.
    """
    scene, centre = ready.scene, ready.centre
    size = scene.width, scene.height, scene.is_hdr, scene.has_view_disparity
    field, _ = field_that_fits(gl.ctx, scene.grid, *size)
    field.color_space = scene.color_space
    field.upload(*scene.grid.centre, centre.colors, centre.disparity)
    return SceneSnapshot(scene, ready.loaded, centre, field)
