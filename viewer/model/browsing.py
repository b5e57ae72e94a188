"""The prompt for a path: what its folder holds, and how a name is completed."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from itertools import takewhile

from viewer.model import messages
from viewer.model.app_state import AppState
from viewer.model.tasks import ChoiceOf, ListTask


@dataclass(frozen=True)
class Listing:
    """Folders and files to choose in a folder. typed: the folder as it was typed; path: the same, absolute."""

    typed: str
    path: str
    folders: tuple[str, ...] = ()
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class PathPrompt:
    """The prompt for the path of a file or folder, on systems without a file dialog.

    listing: of the folder of `path`, None until it is read. top: first row of the listing that is seen.
    """

    what: ChoiceOf
    path: str = ""
    problem: str = ""
    listing: Listing | None = None
    top: int = 0

    @property
    def folder(self) -> str:
        """The folder of the typed path, with a separator at its end; "" if none was typed."""
        return self.path[: max(map(self.path.rfind, (os.sep, "/"))) + 1]


UP = ".."


def edit_path(state: AppState, prompt: PathPrompt) -> AppState:
    """Show the prompt as the user has edited it, and have another folder listed."""
    before = state.prompt
    if not isinstance(before, PathPrompt) or before.folder != prompt.folder:
        state = state.with_tasks(ListTask(prompt))
    if isinstance(before, PathPrompt) and before.path != prompt.path:
        prompt = replace(prompt, top=0)
    return messages.show_prompt(state, prompt)


def set_listing(state: AppState, listing: Listing) -> AppState:
    """Show what a folder holds, unless another path was typed meanwhile."""
    prompt = state.prompt
    if not isinstance(prompt, PathPrompt) or prompt.folder != listing.typed:
        return state
    return replace(state, prompt=replace(prompt, listing=listing))


def shown_names(prompt: PathPrompt) -> tuple[str, ...]:
    """Return the names that begin as the typed one: the folder above, folders with a separator at their end, files."""
    listing = prompt.listing
    if listing is None:
        return ()
    typed = prompt.path[len(prompt.folder) :].casefold()
    names = (*(os.path.join(name, "") for name in listing.folders), *listing.files)
    up = (UP,) if not typed and os.path.dirname(listing.path) != listing.path else ()
    return (*up, *(name for name in names if name.casefold().startswith(typed)))


def path_of(prompt: PathPrompt, name: str) -> str:
    """Return the absolute path of a shown name; that of a folder has a separator at its end."""
    folder = prompt.listing.path if prompt.listing is not None else ""
    return os.path.join(os.path.dirname(folder), "") if name == UP else os.path.join(folder, name)


def completed(prompt: PathPrompt) -> str:
    """Return the path with as much of its name as all shown names have in common; unchanged in an unlisted folder."""
    if prompt.listing is None or prompt.listing.typed != prompt.folder:
        return prompt.path
    names = [name for name in shown_names(prompt) if name != UP]
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*(name.casefold() for name in names)))
    common = names[0][: len(tuple(alike))] if names else ""
    return prompt.folder + common if common else prompt.path
