"""What the user and the worker can do to the state: typed records. `viewer.model.reducers` says what each changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.scenes.scene import Progress, Scene, Source
from viewer.model.action import Action as VerbAction
from viewer.model.state.app_state import DrawReport
from viewer.model.state.folder import FolderAction
from viewer.model.state.preferences import PreferencesAction
from viewer.model.state.saving import SavedSettings

# The lens as a whole, and undo


@dataclass(frozen=True)
class TakeSettings:
    """Take over the settings a picture was saved with; they are made to fit the open scene."""

    settings: SavedSettings


@dataclass(frozen=True)
class RestoreSession:
    """Go on with an opened photo as it was left."""

    settings: SavedSettings


# Files and the worker


@dataclass(frozen=True)
class OpenPath:
    """Open a photo or a light-field folder instead of the present scene."""

    source: Source


@dataclass(frozen=True)
class StopWork:
    """Make no more views; those that are there stay."""


@dataclass(frozen=True)
class NewDepth:
    """The open photo has new depth. in_focus: disparity before and now of the place that was clicked to be sharp."""

    in_focus: tuple[float, float] | None = None


@dataclass(frozen=True)
class SceneOpened:
    """The worker has planned the scene of this generation; its views follow. new_depth: of the photo that is open."""

    generation: int
    scene: Scene
    new_depth: NewDepth | None = None


@dataclass(frozen=True)
class ProgressMade:
    """The worker of this generation came further. view: index (row, column) of the one just made."""

    generation: int
    progress: Progress
    view: tuple[int, int] | None = None


@dataclass(frozen=True)
class OpenFailed:
    """The worker of this generation gave up; the message says why."""

    generation: int
    message: str


@dataclass(frozen=True)
class SetState:
    """Give one field of `AppState` this value; most have actions of their own, for more depends on them."""

    field: Literal["is_fullscreen", "hides_panel", "is_narrow", "report"]
    value: bool | DrawReport | None


WorkerEvent = SceneOpened | ProgressMade | OpenFailed

Action = (
    VerbAction
    | WorkerEvent
    | PreferencesAction
    | SetState
    | FolderAction
    | TakeSettings
    | RestoreSession
    | OpenPath
    | StopWork
)
