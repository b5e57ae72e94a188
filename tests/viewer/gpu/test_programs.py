"""Shader files: all compile, includes come once, errors name the real place, uniforms are checked by name."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import pytest

from iibr_core.runtime.resources import resource_folder
from viewer.gpu.context import GLContext
from viewer.gpu.programs import ShaderError, declared_uniforms, flatten, load_program

VERTEX = "#version 330 core\nvoid main() { gl_Position = vec4(0.0); }\n"
FRAGMENTS = sorted(path.name for path in resource_folder("shaders").glob("*.frag"))


@pytest.mark.parametrize("fragment", FRAGMENTS)
def test_every_shader_compiles_with_every_switch(gl: GLContext, fragment: str) -> None:
    text = flatten(resource_folder("shaders") / fragment).text
    switches = sorted(set(re.findall(r"#ifdef (\w+)", text)))
    for count in range(len(switches) + 1):
        for chosen in itertools.combinations(switches, count):
            load_program(gl.ctx, "fullscreen.vert", fragment, dict.fromkeys(chosen, 1)).release()


def write(folder: Path, **files: str) -> Path:
    (folder / "include").mkdir()
    for name, text in files.items():
        path = folder / "include" / f"{name}.glsl" if name.startswith("part") else folder / f"{name}.frag"
        path.write_text(text)
    (folder / "plain.vert").write_text(VERTEX)
    return folder


def test_include_comes_once_and_defines_follow_the_version(tmp_path: Path) -> None:
    folder = write(
        tmp_path,
        pass_='#version 330 core\n#include "part_a.glsl"\n#include "part_b.glsl"\nvoid main() {}\n',
        part_a='#include "part_b.glsl"\nfloat a;\n',
        part_b="float b;\n",
    )
    flat = flatten(folder / "pass_.frag", {"SIZE": 3})
    assert flat.text.splitlines() == ["#version 330 core", "#define SIZE 3", "float b;", "float a;", "void main() {}"]
    assert flat.locate(3) == "part_b.glsl:1"
    assert flat.locate(4) == "part_a.glsl:2"
    assert flat.locate(5) == "pass_.frag:4"


def test_compile_error_names_file_and_line_of_an_include(gl: GLContext, tmp_path: Path) -> None:
    folder = write(
        tmp_path,
        pass_='#version 330 core\n#include "part_a.glsl"\nout vec4 color;\nvoid main() { color = vec4(value()); }\n',
        part_a="// one\n// two\nfloat value() { return nonsense; }\n",
    )
    with pytest.raises(ShaderError, match=r"\Apart_a\.glsl:3: the shader does not compile\n(.|\n)*nonsense"):
        load_program(gl.ctx, "plain.vert", "pass_.frag", {"A": 1, "B": 2}, folder)


def test_compile_error_names_file_and_line_of_the_pass(gl: GLContext, tmp_path: Path) -> None:
    source = '#version 330 core\n#include "part_a.glsl"\nout vec4 color;\nvoid main() { color = vec3(1.0); }\n'
    folder = write(tmp_path, pass_=source, part_a="float a;\nfloat b;\n")
    with pytest.raises(ShaderError, match=r"\Apass_\.frag:4:"):
        load_program(gl.ctx, "plain.vert", "pass_.frag", folder=folder)


def test_compile_error_in_the_vertex_stage_names_it(gl: GLContext, tmp_path: Path) -> None:
    folder = write(tmp_path, pass_="#version 330 core\nout vec4 color;\nvoid main() { color = vec4(1.0); }\n")
    (folder / "plain.vert").write_text("#version 330 core\nvoid main() { gl_Position = vec3(0.0); }\n")
    with pytest.raises(ShaderError, match=r"\Aplain\.vert:2:"):
        load_program(gl.ctx, "plain.vert", "pass_.frag", folder=folder)


def test_missing_include_names_the_line_that_asks(tmp_path: Path) -> None:
    folder = write(tmp_path, pass_='#version 330 core\n#include "absent.glsl"\n')
    with pytest.raises(ShaderError, match=r"pass_\.frag:2: no such include: absent\.glsl"):
        flatten(folder / "pass_.frag")


def test_unused_uniform_is_skipped_and_misspelt_one_raises(gl: GLContext, tmp_path: Path) -> None:
    source = (
        "#version 330 core\nuniform float used, unused; // uniform float commented;\nout vec4 color;\n"
        "void main() { color = vec4(used); }\n"
    )
    program = load_program(gl.ctx, "plain.vert", "pass_.frag", folder=write(tmp_path, pass_=source))
    program.set_uniform("used", 0.5)
    program.set_uniform("unused", 0.5)
    assert program.program["used"].value == 0.5
    with pytest.raises(KeyError, match=r"no uniform usde; did you mean used\?"):
        program.set_uniform("usde", 0.5)
    with pytest.raises(KeyError, match="commented"):
        program.set_uniform("commented", 0.5)
    program.release()


def test_declared_uniforms_of_lists_and_arrays() -> None:
    source = (
        "uniform vec4 a[4];\n/* uniform int no; */\n  uniform sampler2D b, c;\nlayout(std140) uniform B { vec4 d; };\n"
    )
    assert declared_uniforms(source) == {"a", "b", "c"}
