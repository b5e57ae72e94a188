"""How much of a far, round light a rough surface shows: the GGX microfacet lobe (Walter et al. 2007), energy bounded.

The light is no point: its disc widens the lobe, so that a mirror shows the light itself and nothing is brighter.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage


def lobe_shares(
    normals: FloatImage, to_eye: FloatImage, light: FloatImage, width2: float, disc: float, reflectance: float
) -> FloatImage:
    """`reflected_share` of many places under one light (3,). normals, to_eye: (N, 3), of length 1; (N,)."""
    shares = np.empty(len(normals), np.float32)
    _fill_shares(normals, to_eye, np.asarray(light, np.float32), width2, disc, reflectance, shares)
    return shares


@kernel
def _fill_shares(normals, to_eye, light, width2, disc, reflectance, shares):
    for i in range(len(shares)):
        shares[i] = reflected_share(
            normals[i, 0], normals[i, 1], normals[i, 2], to_eye[i, 0], to_eye[i, 1], to_eye[i, 2],
            light[0], light[1], light[2], width2, disc, reflectance,
        )  # fmt: skip


@kernel
def reflected_share(nx, ny, nz, vx, vy, vz, lx, ly, lz, width2, disc, reflectance):
    """The share of the light's radiance that a surface shows, 0..1: GGX, Smith's shadowing, Schlick's Fresnel term.

    n: normal, v: towards the eye, l: towards the light, each of length 1. width2, disc: see `Gloss.lobe_widths`.
    """
    n_l = nx * lx + ny * ly + nz * lz
    n_v = nx * vx + ny * vy + nz * vz
    if not (n_l > 0 and n_v > 0):
        return 0.0  # the light is behind the surface, or the eye is
    hx, hy, hz = vx + lx, vy + ly, vz + lz
    length = sqrt(hx * hx + hy * hy + hz * hz)
    if not length > 1e-6:
        return 0.0
    hx, hy, hz = hx / length, hy / length, hz / length
    n_h, v_h = nx * hx + ny * hy + nz * hz, vx * hx + vy * hy + vz * hz
    # 1 - (n.h)^2 as a cross product: near the peak of a narrow lobe the difference would be rounding
    sx, sy, sz = ny * hz - nz * hy, nz * hx - nx * hz, nx * hy - ny * hx
    spread = width2 * n_h * n_h + sx * sx + sy * sy + sz * sz
    # the disc's irradiance / pi times D pi, the height-correlated G / (4 n.l n.v), and n.l
    masking = n_l * sqrt(n_v * n_v * (1 - width2) + width2) + n_v * sqrt(n_l * n_l * (1 - width2) + width2)
    seen = disc * width2 / (spread * spread) * 0.5 / masking * n_l
    grazing = 1 - min(v_h, 1.0)
    fresnel = reflectance + (1 - reflectance) * grazing * grazing * grazing * grazing * grazing
    return fresnel * min(seen, 1.0)
