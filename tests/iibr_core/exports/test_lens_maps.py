import numpy as np
import OpenImageIO as oiio
from scipy.ndimage import binary_erosion

from tests.iibr_core.exports.conftest import exported


def values_of(path):
    image = oiio.ImageInput.open(str(path))
    spec = image.spec()
    return np.asarray(image.read_image(format=spec.format))[..., 0], str(spec.format), spec.nchannels


def test_the_matte_is_the_surface_that_was_picked(source, tmp_path):
    disparity = source.centre_view().disparity
    is_near = disparity == disparity.max()
    y, x = (int(np.mean(places)) for places in np.nonzero(is_near))
    near, kind, _ = values_of(exported(source, "matte", tmp_path / "near.png", at=(x + 0.5, y + 0.5)))
    wall, *_ = values_of(exported(source, "matte", tmp_path / "wall.png", at=(0, 0)))
    assert kind == "uint16"
    inner = binary_erosion(is_near, iterations=5)
    assert near[inner].min() > 65000
    assert wall[inner].max() < 500
    assert wall[0, 0] > 65000
    assert np.abs(near / 65535 - is_near).mean() < 0.02
