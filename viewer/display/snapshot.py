"""What is open at one moment, held for work that goes on after it: the window may show another scene by then."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.scenes import GlossFound, LoadedPhoto, Scene
from iibr_core.types import ViewUpdate
from viewer.gpu.light_field_texture import LightFieldTexture


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

    def release(self) -> None:
        """Let the views go. Only in the thread of the window."""
        self.field.release()
