"""Options of commands, and records of them: a parameter that is a dataclass stands for an option of each field."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Any, get_type_hints

import typer


def option(text: str, metavar: str | None = None, default: str = "", *names: str, **limits: Any) -> Any:
    """Return an option with a help text.

    metavar: kind of value, None for that of the type. default: words shown in place of None. names: as they are typed,
    none for that of the parameter. limits: min, max or a parser.
    """
    return typer.Option(*names, help=text, metavar=metavar, show_default=default or True, **limits)


def output_option(text: str, metavar: str = "FILE") -> Any:
    """Return the option that names the output."""
    return option(text, metavar, "", "--output", "-o")


def flag(name: str, text: str) -> Any:
    """Return an option without a value."""
    return option(text, "", "", name)


def with_option_records(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command for Typer, with an option for each field of its records."""
    parameters = signature(command, eval_str=True).parameters.values()
    options = [each for parameter in parameters for each in _options_of(parameter)]
    records: dict[str, Any] = {each.name: each.annotation for each in parameters if is_dataclass(each.annotation)}

    @wraps(command)
    def run(**values: Any) -> None:
        for name, record in records.items():
            values[name] = record(**{field.name: values.pop(field.name) for field in fields(record)})
        command(**values)

    run.__signature__ = Signature(options)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in options}
    return run


def _options_of(parameter: Parameter) -> Iterator[Parameter]:
    """Yield the parameter, or one for each field of its record."""
    if not is_dataclass(parameter.annotation):
        yield parameter.replace(kind=Parameter.KEYWORD_ONLY)
        return
    types = get_type_hints(parameter.annotation, include_extras=True)
    for field in fields(parameter.annotation):
        default = Parameter.empty if field.default is MISSING else field.default
        yield Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=types[field.name])
