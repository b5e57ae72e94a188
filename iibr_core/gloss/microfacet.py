"""Share of a far, round light that a rough surface shows: the GGX microfacet lobe (Walter et al. 2007), energy bounded.

The light is no point: its disc widens the lobe, so that a mirror shows the light itself and nothing is brighter.
`shaders/include/gloss.glsl` holds the same formula.
"""

from __future__ import annotations

from math import sqrt

from iibr_core.runtime.kernels import kernel


@kernel
def reflected_share(normal, to_eye, light, lobe):
    """Return the share of the light's radiance that a surface shows, 0..1: GGX, Smith's shadowing, Schlick's Fresnel.

    normal, to_eye, light (towards it): triples of length 1. lobe: `Gloss.lobe`.
    """
    width2, disc, reflectance = lobe
    n_l, n_v = dot(normal, light), dot(normal, to_eye)
    if n_l <= 0 or n_v <= 0:
        return 0.0  # the light or the eye is behind the surface
    half = unit((to_eye[0] + light[0], to_eye[1] + light[1], to_eye[2] + light[2]))
    n_h, v_h = dot(normal, half), dot(to_eye, half)
    # 1 - n_h^2 as a cross product: near the peak of a narrow lobe the difference would be rounding
    beside = cross(normal, half)
    spread = width2 * n_h * n_h + dot(beside, beside)
    # the disc's irradiance / pi times D pi, the height-correlated G / (4 n.l n.v), and n.l
    masking = n_l * sqrt(n_v * n_v * (1 - width2) + width2) + n_v * sqrt(n_l * n_l * (1 - width2) + width2)
    seen = disc * width2 / (spread * spread) * 0.5 / masking * n_l
    fresnel = reflectance + (1 - reflectance) * (1 - min(v_h, 1.0)) ** 5
    return fresnel * min(seen, 1.0)


@kernel
def dot(a, b):
    """Return the scalar product of two triples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a, b):
    """Return the vector product of two triples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def unit(a):
    """Return a triple, not 0, scaled to length 1."""
    length = sqrt(dot(a, a))
    return a[0] / length, a[1] / length, a[2] / length
