"""Actions: a verb of the model, which is a function of the state, and its arguments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

from iibr_core.scenes.lens_limits import clamp

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


P = ParamSpec("P")
Value = TypeVar("Value")
Setter = Callable[["AppState", Value], "AppState"]
"""Verb that sets one field."""


@dataclass(frozen=True)
class Action:
    """A change of the state. Actions with the same verb and arguments are equal."""

    verb: Callable[..., AppState]
    args: tuple[Any, ...] = ()
    kwargs: tuple[tuple[str, Any], ...] = ()

    def apply(self, state: AppState) -> AppState:
        """Return the state after this action."""
        return self.verb(state, *self.args, **dict(self.kwargs))


def do(verb: Callable[Concatenate[AppState, P], AppState], *args: P.args, **kwargs: P.kwargs) -> Action:
    """Return the action that calls `verb(state, *args, **kwargs)`. A type checker compares the arguments."""
    return Action(verb, args, tuple(sorted(kwargs.items())))


def setter(path: str, limits: tuple[float, float] | None = None) -> Setter[Any]:
    """Return the verb that sets a field of the state, or of a record in it as "record.field", within its limits."""
    record, _, name = path.rpartition(".")

    def verb(state: AppState, value: Any, /) -> AppState:
        value = value if limits is None else clamp(value, *limits)
        changed: Any = replace(getattr(state, record), **{name: value}) if record else value
        return replace(state, **{record or name: changed})

    return verb
