"""Shader programs from files: errors at the real file and line, uniforms checked by name."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import moderngl

from iibr_core.color import primaries_matrix
from iibr_core.runtime.resources import resource_folder
from iibr_core.runtime.shader_sources import FlatSource, ShaderError, flatten
from iibr_core.scenes.rect import WHOLE
from iibr_core.types import ColorSpace

_UNIFORM = re.compile(r"^\s*uniform\s+\w+\s+([^;]+);", re.MULTILINE)
_MESSAGE_LINE = re.compile(r"^\s*(?:ERROR:\s*)?\d+[:(](\d+)(?:\(\d+\)|\))?\s*:", re.MULTILINE)


class Program:
    """A linked program. `declared` are the uniforms its sources name, whether the compiler kept them or not."""

    def __init__(self, program: moderngl.Program, declared: frozenset[str], name: str) -> None:
        self.program = program
        self.declared = declared
        self.name = name

    def set_uniform(self, name: str, value: Any) -> None:
        """Set a uniform; one that the compiler optimised out is skipped.

        Raises KeyError for a name the sources do not declare, with the nearest one that they do.
        """
        if name not in self.declared:
            near = difflib.get_close_matches(name, self.declared, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise KeyError(f"{self.name} declares no uniform {name}{hint}")
        member: Any = self.program.get(name, None)
        if member is not None:
            member.value = value

    def set_uniforms(self, **values: Any) -> None:
        """`set_uniform` for each keyword."""
        for name, value in values.items():
            self.set_uniform(name, value)

    def bind_block(self, name: str, binding: int) -> None:
        """Connect a uniform block to a binding point; one that the compiler optimised out is skipped."""
        block: Any = self.program.get(name, None)
        if block is not None:
            block.binding = binding

    def release(self) -> None:
        """Free the program."""
        self.program.release()


def load_program(
    ctx: moderngl.Context,
    vertex: str,
    fragment: str,
    defines: Mapping[str, int] | None = None,
    folder: Path | None = None,
) -> Program:
    """Compile `shaders/<vertex>` and `shaders/<fragment>`.

    folder: where the shaders are, if not the program's own. Raises ShaderError naming file and line.
    """
    folder = folder or resource_folder("shaders")
    stages = {"vertex": flatten(folder / vertex, defines), "fragment": flatten(folder / fragment, defines)}
    try:
        program = ctx.program(vertex_shader=stages["vertex"].text, fragment_shader=stages["fragment"].text)
    except moderngl.Error as error:
        raise ShaderError(_explain(str(error), stages, fragment)) from error
    declared = frozenset(name for stage in stages.values() for name in declared_uniforms(stage.text))
    return Program(program, declared, fragment)


def declared_uniforms(source: str) -> set[str]:
    """Names of the uniforms a source declares, array suffixes left off."""
    code = re.sub(r"//[^\n]*|/\*.*?\*/", "", source, flags=re.DOTALL)
    names = (name for group in _UNIFORM.findall(code) for name in group.split(","))
    return {name.split("[")[0].strip() for name in names}


def _explain(message: str, stages: Mapping[str, FlatSource], fragment: str) -> str:
    """The driver's message with its line numbers turned into file:line; drivers write 0:12(3), 0(12) or ERROR: 0:12."""
    stage = stages["vertex" if "vertex_shader" in message else "fragment"]
    found = [(match, stage.locate(int(match[1]))) for match in _MESSAGE_LINE.finditer(message)]
    if not found:
        return f"{fragment}: {message.strip()}"
    first = found[0][1]
    body = _MESSAGE_LINE.sub(lambda match: f"{stage.locate(int(match[1]))}:", message[found[0][0].start() :])
    return f"{first}: the shader does not compile\n{body.strip()}"


def set_primaries(program: Program, target: ColorSpace, source: ColorSpace) -> None:
    """Tell a program with OTHER_PRIMARIES how light of the one becomes light of the other: see shaders/include."""
    if "target_from_source" in program.declared:
        program.set_uniform("target_from_source", tuple(primaries_matrix(target, source).T.ravel().tolist()))


class ProgramCache:
    """The programs in use, compiled when first asked for."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[tuple[str, tuple[str, ...]], tuple[Program, moderngl.VertexArray]] = {}

    def __len__(self) -> int:
        """How many programs have been compiled."""
        return len(self._programs)

    def get(self, fragment: str, switches: tuple[str, ...] = ()) -> tuple[Program, moderngl.VertexArray]:
        """The program of a pass with these defines, and what to draw it with. Raises ShaderError."""
        key = fragment, switches
        if key not in self._programs:
            self._programs[key] = self._compile(fragment, switches)
        return self._programs[key]

    def release(self) -> None:
        """Free every program."""
        for program, quad in self._programs.values():
            quad.release()
            program.release()
        self._programs.clear()

    def _compile(self, fragment: str, switches: tuple[str, ...]) -> tuple[Program, moderngl.VertexArray]:
        program = load_program(self._ctx, "fullscreen.vert", fragment, dict.fromkeys(switches, 1))
        program.set_uniform("part", WHOLE)  # of the picture, until a pass says otherwise
        return program, self._ctx.vertex_array(program.program, [])
