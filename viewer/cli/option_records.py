"""Options that several commands share, as records: a parameter that is a dataclass stands for its fields."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Any, get_type_hints


def with_option_records(command: Callable[..., None]) -> Callable[..., None]:
    """The command as typer is to see it: the fields of its records are options of their own, in their place."""
    asked = signature(command, eval_str=True).parameters.values()
    parameters = [parameter for each in asked for parameter in _parameters_of(each)]
    records: dict[str, Any] = {each.name: each.annotation for each in asked if is_dataclass(each.annotation)}

    @wraps(command)
    def called(**given: Any) -> None:
        for name, record in records.items():
            given[name] = record(**{field.name: given.pop(field.name) for field in fields(record)})
        command(**given)

    called.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return called


def _parameters_of(parameter: Parameter) -> Iterator[Parameter]:
    """The parameter, or one for each field of the record that it is."""
    if not is_dataclass(parameter.annotation):
        yield parameter.replace(kind=Parameter.KEYWORD_ONLY)
        return
    types = get_type_hints(parameter.annotation, include_extras=True)
    for field in fields(parameter.annotation):
        default = Parameter.empty if field.default is MISSING else field.default
        yield Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=types[field.name])
