"""Things of known shape for tests of gloss: exact disparity and normals, in view steps."""

import numpy as np

from iibr_core.gloss.geometry import SceneGeometry

SIZE = 60, 80
GEOMETRY = SceneGeometry(focal_px=90.0, infinity=-1.5)


def rays(size=SIZE, geometry=GEOMETRY):
    y, x = np.mgrid[: size[0], : size[1]].astype(np.float64)
    return np.stack(
        [(x - (size[1] - 1) / 2) / geometry.focal_px, (y - (size[0] - 1) / 2) / geometry.focal_px, np.ones(size)], -1
    )


def disparity_of(depth, geometry=GEOMETRY):
    return (geometry.focal_px / depth + geometry.infinity).astype(np.float32)


def sphere(centre=(0, 0, 40.0), radius=12.0, behind=60.0):
    """(disparity, normals, hit) of a sphere before a wall."""
    direction, centre = rays(), np.array(centre)
    a, b, c = (direction**2).sum(-1), direction @ centre, centre @ centre - radius**2
    root = b * b - a * c
    hit = root > 0
    depth = np.where(hit, (b - np.sqrt(np.maximum(root, 0))) / a, behind)
    normals = np.where(hit[..., None], (direction * depth[..., None] - centre) / radius, [0, 0, -1.0])
    return disparity_of(depth), normals.astype(np.float32), hit


def plane(normal=(0.3, -0.4, -1.0), distance=40.0):
    """(disparity, normal) of a plane through (0, 0, distance)."""
    normal = np.array(normal) / np.linalg.norm(normal)
    depth = distance * normal[2] / (rays() @ normal)
    return disparity_of(depth), normal.astype(np.float32)
