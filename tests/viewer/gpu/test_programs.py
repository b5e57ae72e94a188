"""Shader files: all compile, includes come once, errors name the real place, uniforms are checked by name."""

import itertools
import re

import pytest

from iibr_core.runtime.resources import resource_folder
from iibr_core.runtime.shader_sources import ShaderError, flatten
from viewer.gpu.programs import Program

VERTEX = "#version 330 core\nuniform vec4 part;\nvoid main() { gl_Position = part; }\n"
FRAGMENTS = sorted(path.name for path in resource_folder("shaders").glob("*.frag"))
INCLUDING = '#version 330 core\n#include "part_a.glsl"\nout vec4 color;\nvoid main() { color = CODE; }\n'


@pytest.mark.parametrize("fragment", FRAGMENTS)
def test_every_shader_compiles_with_every_switch(gl, fragment):
    text = flatten(resource_folder("shaders") / fragment).text
    switches = sorted(set(re.findall(r"(?:^#ifn?def |\bdefined\()(\w+)", text, re.MULTILINE)))
    pairs = [(one, other) for one, other in itertools.combinations(switches, 2)]
    for chosen in ((), *zip(switches), *pairs, tuple(switches)):
        Program(gl.ctx, fragment, chosen).release()


def write(folder, **files):
    (folder / "include").mkdir()
    for name, text in files.items():
        path = folder / "include" / f"{name}.glsl" if name.startswith("part") else folder / f"{name}.frag"
        path.write_text(text)
    (folder / "fullscreen.vert").write_text(VERTEX)
    return folder


@pytest.mark.parametrize(
    ("source", "part_a", "place"),
    [
        (INCLUDING.replace("CODE", "vec4(value())"), "//\n//\nfloat value() { return none; }\n", r"part_a\.glsl:3"),
        (INCLUDING.replace("CODE", "vec3(1.0)"), "float a;\nfloat b;\n", r"pass_\.frag:4"),
        ('#version 330 core\n#include "absent.glsl"\n', "", r"pass_\.frag:2: no such include: absent\.glsl"),
    ],
)
def test_errors_name_file_and_line(gl, tmp_path, source, part_a, place):
    folder = write(tmp_path, pass_=source, part_a=part_a)
    with pytest.raises(ShaderError, match=rf"\A{place}"):
        Program(gl.ctx, "pass_.frag", ("A", "B"), folder)


def test_unused_uniform_is_skipped_and_misspelt_one_raises(gl, tmp_path):
    source = (
        "#version 330 core\nuniform float used, unused; // uniform float commented;\nout vec4 color;\n"
        "void main() { color = vec4(used); }\n"
    )
    program = Program(gl.ctx, "pass_.frag", folder=write(tmp_path, pass_=source))
    target = gl.ctx.simple_framebuffer((1, 1))
    target.use()
    program.set_uniforms(used=0.5, unused=0.5, part=(-1.0, -1.0, 2.0, 2.0))
    with pytest.raises(KeyError, match="no uniform usde"):
        program.set_uniforms(usde=0.5)
    with pytest.raises(KeyError, match="commented"):
        program.set_uniforms(commented=0.5)
    program.release()
    target.release()
