"""Every small fault that a file of Python could have: what tests must find. Texts, types and defaults stay."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate

COMPARISONS = {
    ast.Lt: (ast.Gt, ast.LtE),
    ast.Gt: (ast.Lt, ast.GtE),
    ast.LtE: (ast.GtE, ast.Lt),
    ast.GtE: (ast.LtE, ast.Gt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
}
SWAPPED = {"min": "max", "max": "min"}
UNTOUCHED = (ast.AnnAssign, ast.JoinedStr, ast.arguments, ast.Import, ast.ImportFrom, ast.Raise)
"""Types, texts, defaults."""


@dataclass(frozen=True)
class Fault:
    """A small fault: its file, its place in words, and the file's text with it."""

    path: str
    what: str
    source: str


def faults_of(name: str, source: str) -> Iterator[Fault]:
    """Every small fault that a file could have, in its order."""
    text = source.encode()
    starts = [0, *accumulate(map(len, text.splitlines(keepends=True)))]
    for node, now in _changes(ast.parse(text)):
        first = starts[node.lineno - 1] + node.col_offset
        last = starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)
        was = " ".join(text[first:last].decode().split())
        faulty = (text[:first] + now.encode() + text[last:]).decode()
        yield Fault(name, f"{name}:{node.lineno}:{node.col_offset + 1}: `{was}` -> `{now}`", faulty)


def _changes(tree: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """Expressions and statements, and what may stand for each."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, UNTOUCHED) or _is_allocation(node):
            continue
        if isinstance(node, ast.FunctionDef):
            yield from ((each, "pass") for each in _droppable(node))
            yield from _changes(ast.Module(node.body, []))
            continue
        if isinstance(node, ast.expr):
            yield from ((node, now) for now in _instead(node))
        if isinstance(node, ast.If | ast.IfExp | ast.While):
            yield node.test, f"(not ({ast.unparse(node.test)}))"
        yield from _changes(node)


def _instead(node: ast.expr) -> Iterator[str]:
    """Yield what may replace an expression."""
    match node:
        case ast.Compare(left, operators, others):
            for k, operator in enumerate(operators):
                for other in COMPARISONS.get(type(operator), ()):
                    yield f"({ast.unparse(ast.Compare(left, [*operators[:k], other(), *operators[k + 1 :]], others))})"
        case ast.BinOp(left, ast.Add() | ast.Sub() as operator, right):
            swapped = ast.Sub() if isinstance(operator, ast.Add) else ast.Add()
            yield f"({ast.unparse(ast.BinOp(left, swapped, right))})"
        case ast.BoolOp(operator, values):
            yield f"({ast.unparse(ast.BoolOp(ast.Or() if isinstance(operator, ast.And) else ast.And(), values))})"
        case ast.Constant(int() | float() as value) if not isinstance(value, bool):
            yield repr(2 * value or type(value)(1))
            if value:
                yield repr(value // 2 if isinstance(value, int) else value / 2)
        case ast.Name(name) if name in SWAPPED:
            yield SWAPPED[name]
        case ast.Subscript(array, index):
            parts = index.elts if isinstance(index, ast.Tuple) else [index]
            for k, part in enumerate(parts):
                if isinstance(part, ast.BinOp | ast.Call) or (isinstance(part, ast.Name) and part.id.islower()):
                    moved = [*parts[:k], ast.BinOp(part, ast.Add(), ast.Constant(1)), *parts[k + 1 :]]
                    yield f"{ast.unparse(array)}[{', '.join(map(ast.unparse, moved))}]"


def _is_allocation(node: ast.AST) -> bool:
    """Whether it makes room, of which more changes nothing and less ruins the process."""
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in ("empty", "zeros")


def _droppable(function: ast.FunctionDef) -> Iterator[ast.stmt]:
    """Statements that assign what has a value without them, too: all others, any call would miss."""
    given = Counter(argument.arg for argument in function.args.args) + _assigned(function)
    for node in ast.walk(function):
        if isinstance(node, ast.Assign | ast.AugAssign):
            own = _assigned(node)
            yield from [node] * all(given[name] > own[name] for name in own)


def _assigned(tree: ast.AST) -> Counter[str]:
    return Counter(n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
