"""Gloss from TOML files: what they say, and one line for what makes no sense."""

import pytest

from iibr_core.gloss.settings import Gloss, GlossLight, GlossStroke, GlossSurface
from iibr_core.types import InputError
from viewer.app.gloss_file import read_gloss

WHOLE = """
roughness = 0
reflectance = 0.5
environment = ""
photo_shines = false
[surface]
farthest = 0.25
color = [1, 0, 0]
strokes = [{points = [[0.5, 0.5], [0.6, 0.5]], radius = 0.1, erases = true}]
[light]
direction = [0, -1, -1]
color = [2, 1.5, 1]
radius_deg = 1
"""


def test_a_file_says_everything(tmp_path):
    path = tmp_path / "gloss.toml"
    path.write_text(WHOLE)
    stroke = GlossStroke(((0.5, 0.5), (0.6, 0.5)), 0.1, erases=True)
    surface = GlossSurface(0.25, 1.0, (1, 0, 0), strokes=(stroke,))
    light = GlossLight((0, -1, -1), (2, 1.5, 1), 1)
    assert read_gloss(path) == Gloss(surface, 0, 0.5, light)


@pytest.mark.parametrize(
    ("text", "gloss"), [("# nothing", Gloss()), ("\ufeffroughness = 0.5", Gloss(roughness=0.5))], ids=["usual", "bom"]
)
def test_what_a_file_leaves_out_is_as_usual(tmp_path, text, gloss):
    path = tmp_path / "gloss.toml"
    path.write_text(text, "utf-8")
    assert read_gloss(path) == gloss


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("roughness = nan", "roughness"),
        ('roughness = "dull"', "roughness"),
        ("rough = 0.5", "rough"),
        ("[surface]\ncolor = [0, 0, 2]", "surface.color"),
        ("[surface]\nstrokes = [{points = [[0.5, nan]], radius = 0.1}]", "points"),
        ("[light]\nradius_deg = 0", "light.radius_deg"),
        ("[light]\ndirection = [0, 0, 0]", "direction"),
        ("a = " + "[" * 5000, "not a gloss"),
        ("a" * 2_000_000, "is larger than"),
    ],
)
def test_what_makes_no_sense_is_named_in_one_line(tmp_path, text, named):
    path = tmp_path / "gloss.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=named) as refused:
        read_gloss(path)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)
