"""mypy lets functions of the core go without types, for the sake of kernels; here, nothing but kernels may."""

import ast
from pathlib import Path

import iibr_core

CORE = Path(iibr_core.__file__).parent
LEAST_SOURCES = 100


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


def test_only_kernels_go_without_types():
    sources = sorted(CORE.rglob("*.py"))
    assert len(sources) > LEAST_SOURCES
    assert [
        f"{path.relative_to(CORE)}: {name}" for path in sources for name in untyped_functions(path.read_text("utf-8"))
    ] == []
