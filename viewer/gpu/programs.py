"""Shader programs from files. Errors name the file and line of a shader; uniforms are checked by name."""

from __future__ import annotations

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

OVER_ALL = "fullscreen.vert"
"""Vertex shader of passes over the whole target."""
_UNIFORM = re.compile(r"^\s*uniform\s+\w+\s+([^;]+);", re.MULTILINE)
_MESSAGE_LINE = re.compile(r"^\s*(?:ERROR:\s*)?\d+[:(](\d+)(?:\(\d+\)|\))?\s*:", re.MULTILINE)
"""Place of an error in a driver's message: "0:12(3):", "0(12) :" or "ERROR: 0:12:"."""


class Program:
    """A pass: a fragment shader with some switches on, over the whole target unless another vertex shader is given."""

    def __init__(
        self,
        ctx: moderngl.Context,
        fragment: str,
        switches: tuple[str, ...] = (),
        folder: Path | None = None,
        vertex: str = OVER_ALL,
    ) -> None:
        """Compile it. folder: folder of the shaders, None for the installed ones.

        Raises ShaderError with the file and line of the first error.
        """
        folder, defines = folder or resource_folder("shaders"), dict.fromkeys(switches, 1)
        corners, source = (flatten(folder / name, defines) for name in (vertex, fragment))
        try:
            self._program: Any = ctx.program(vertex_shader=corners.text, fragment_shader=source.text)
        except moderngl.Error as error:
            stage = corners if "vertex_shader" in str(error) else source
            raise ShaderError(_with_places(str(error), stage, fragment)) from error
        self._name, self._declared = fragment, declared_uniforms(corners.text + source.text)
        self._corners = ctx.vertex_array(self._program, [])
        if vertex == OVER_ALL:
            self.set_uniforms(part=WHOLE)

    def set_uniforms(self, **values: Any) -> None:
        """Set uniforms; those that the compiler optimised out are skipped.

        Raises KeyError for a name that the sources do not declare.
        """
        for name, value in values.items():
            if name not in self._declared:
                raise KeyError(f"{self._name} declares no uniform {name}")
            if (member := self._program.get(name, None)) is not None:
                member.value = value

    def set_primaries(self, target: ColorSpace, source: ColorSpace) -> None:
        """Set the conversion of light from one colour space to another, see shaders/include/primaries.glsl."""
        self.set_uniforms(target_from_source=tuple(primaries_matrix(target, source).T.ravel().tolist()))

    def use_block(self, name: str, buffer: moderngl.Buffer, offset: int = 0, size: int = -1) -> None:
        """Use a buffer, or a part of it in bytes, as the uniform block of this name."""
        buffer.bind_to_uniform_block(0, offset=offset, size=size)
        if (block := self._program.get(name, None)) is not None:
            block.binding = 0

    def draw(self) -> None:
        """Draw a triangle that covers the whole target."""
        self._corners.render(moderngl.TRIANGLES, vertices=3)

    def draw_points(self, count: int) -> None:
        """Draw points, whose size the vertex shader sets."""
        self._corners.render(moderngl.POINTS, vertices=count)

    def release(self) -> None:
        """Free the program."""
        self._corners.release()
        self._program.release()


def declared_uniforms(source: str) -> set[str]:
    """Return the names of the uniforms that a source declares, without array suffixes."""
    code = re.sub(r"//[^\n]*|/\*.*?\*/", "", source, flags=re.DOTALL)
    names = (name for group in _UNIFORM.findall(code) for name in group.split(","))
    return {name.split("[")[0].strip() for name in names}


def _with_places(message: str, stage: FlatSource, fragment: str) -> str:
    """Return a driver's message with file and line in place of its own line numbers."""
    first = _MESSAGE_LINE.search(message)
    if first is None:
        return f"{fragment}: {message.strip()}"
    body = _MESSAGE_LINE.sub(lambda match: f"{stage.locate(int(match[1]))}:", message[first.start() :])
    return f"{stage.locate(int(first[1]))}: the shader does not compile\n{body.strip()}"


class ProgramCache:
    """The programs in use, compiled when they are needed first."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[tuple[str, ...], Program] = {}

    def __len__(self) -> int:
        """Return the number of programs compiled so far."""
        return len(self._programs)

    def get(self, fragment: str, switches: Mapping[str, bool] | None = None, vertex: str = OVER_ALL) -> Program:
        """Return the program of two shaders with those switches that are on. Raises ShaderError."""
        key = vertex, fragment, *(name for name, is_on in (switches or {}).items() if is_on)
        if key not in self._programs:
            self._programs[key] = Program(self._ctx, fragment, key[2:], vertex=vertex)
        return self._programs[key]

    def release(self) -> None:
        """Free every program."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()
