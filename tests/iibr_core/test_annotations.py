"""mypy lets functions of the core go without types, for the sake of kernels; here, nothing but kernels may."""

import ast
from pathlib import Path

import pytest

import iibr_core

SOURCES = sorted(Path(iibr_core.__file__).parent.rglob("*.py"))


def untyped_functions(source):
    """Names of the functions that state no type at all; where only some are stated, mypy complains."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        every = node.args
        arguments = [*every.posonlyargs, *every.args, *every.kwonlyargs, every.vararg, every.kwarg]
        typed = node.returns or any(argument and argument.annotation for argument in arguments)
        is_kernel = any(isinstance(mark, ast.Name) and mark.id == "kernel" for mark in node.decorator_list)
        if not typed and not is_kernel:
            yield node.name


@pytest.mark.parametrize("path", SOURCES, ids=[f"{path.parent.name}/{path.name}" for path in SOURCES])
def test_only_kernels_go_without_types(path):
    assert list(untyped_functions(path.read_text("utf-8"))) == []


def test_an_untyped_function_is_found():
    assert list(untyped_functions("@kernel\ndef a(x): ...\ndef b(x): ...\ndef c(x) -> int: ...")) == ["b"]
