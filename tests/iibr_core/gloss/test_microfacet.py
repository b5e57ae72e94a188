"""GGX against the textbook's formula, its energy, and its limits."""

from itertools import product
from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest

from iibr_core.gloss.microfacet import reflected_share
from iibr_core.gloss.settings import Gloss, GlossLight

UP = np.array([0.0, 0.0, 1.0])


def direction(polar_deg, azimuth_deg=0.0):
    polar, azimuth = radians(polar_deg), radians(azimuth_deg)
    return np.array([sin(polar) * cos(azimuth), sin(polar) * sin(azimuth), cos(polar)])


def share(gloss, n, v, light):
    return reflected_share(tuple(n), tuple(v), tuple(light), gloss.lobe)


def textbook(gloss, n, v, light):
    """D G F / (4 n.l n.v) times the irradiance of a disc of radiance 1; Walter et al. 2007, Heitz 2014."""
    width2, disc, _ = gloss.lobe
    h = (v + light) / np.linalg.norm(v + light)
    n_l, n_v, n_h, v_h = n @ light, n @ v, n @ h, v @ h
    d = width2 / (pi * (n_h**2 * (width2 - 1) + 1) ** 2)

    def smith_lambda(cosine):
        return (-1 + sqrt(1 + width2 * (1 / cosine**2 - 1))) / 2

    g = 1 / (1 + smith_lambda(n_l) + smith_lambda(n_v))
    f = gloss.reflectance + (1 - gloss.reflectance) * (1 - v_h) ** 5
    return f * min(d * g / (4 * n_l * n_v) * n_l * pi * disc, 1.0)


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.7, 1.0])
def test_it_is_the_textbooks_lobe(roughness):
    gloss = Gloss(roughness=roughness, reflectance=0.08)
    rng = np.random.default_rng(1)
    for _ in range(50):
        v, light = direction(*rng.uniform((0, 0), (85, 360))), direction(*rng.uniform((0, 0), (85, 360)))
        assert share(gloss, UP, v, light) == pytest.approx(textbook(gloss, UP, v, light), rel=1e-6, abs=1e-12)


def test_a_mirror_shows_the_light_itself_and_nothing_beside_it():
    mirror = Gloss(roughness=0.0, reflectance=1.0, light=GlossLight(radius_deg=2.0))
    v = direction(30)
    assert share(mirror, UP, v, direction(30, 180)) == pytest.approx(1.0, rel=0.01)
    assert share(mirror, UP, v, direction(45, 180)) < 0.01


@pytest.mark.parametrize("roughness", [0.35, 1.0])
@pytest.mark.parametrize("polar_deg", [0, 75, 88])
def test_no_more_light_leaves_than_came(roughness, polar_deg):
    """Over all directions of the eye, a light of irradiance 1 gives at most 1, whatever the surface."""
    gloss = Gloss(roughness=roughness, reflectance=1.0, light=GlossLight(radius_deg=1.0))
    disc, light, count, total = gloss.lobe[1], direction(polar_deg), 100, 0.0
    for p, a in product((np.arange(count) + 0.5) / count * pi / 2, (np.arange(count) + 0.5) / count * pi):
        total += share(gloss, UP, (sin(p) * cos(a), sin(p) * sin(a), cos(p)), light) * cos(p) * sin(p)
    total *= (pi / 2 / count) * (2 * pi / count)
    assert 0 < total / (pi * disc * cos(radians(polar_deg))) <= 1.02


@pytest.mark.parametrize(
    ("v", "light"), [((30, 0), (91, 180)), ((91, 0), (30, 180)), ((120, 0), (120, 180)), ((0, 0), (180, 0))]
)
def test_light_or_eye_behind_the_surface_gives_nothing(v, light):
    assert share(Gloss(), UP, direction(*v), direction(*light)) == 0
