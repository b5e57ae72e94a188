"""A photo at its own size: the same parallax as in the light field, in relation to its width."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.editing.edits import DepthEdits, Stroke
from iibr_core.scenes.large_photo import load_large
from iibr_core.scenes.photo import load_photo, make_plan
from iibr_core.scenes.scene import DepthSettings, Source
from iibr_core.types import GridShape, InputError
from tests.viewer.conftest import HEIGHT, WIDTH

SMALLER = 4
MOST = 10**6
STROKE = DepthEdits(strokes=(Stroke("nearer", ((0.2, 0.2),), 0.1, 0.5),))


def source_of(photo: Path, **changes: object) -> Source:
    return Source(str(photo), grid=GridShape(3, 3), max_pixels=HEIGHT * WIDTH // SMALLER**2, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize("edits", [DepthEdits(), STROKE], ids=["as found", "with a stroke"])
@pytest.mark.parametrize("stored", ["larger", "smaller", "guess"])
def test_disparity_grows_with_the_pixels(photo_path: Path, stored: str, edits: DepthEdits) -> None:
    """Whether the map's file holds more than the light field's views do, less, or there is none."""
    map_path = photo_path.with_name("scene_disparity.npy")
    if stored == "smaller":
        np.save(map_path, np.load(map_path)[::8, ::8])
    elif stored == "guess":
        map_path.unlink()
    source = source_of(photo_path, depth=DepthChoice(start="rough" if stored == "guess" else "auto"))
    loaded = load_photo(source, depth_settings=DepthSettings(0.0, edits))
    assert loaded.photo.size == (HEIGHT // SMALLER, WIDTH // SMALLER)
    plan = make_plan(source, loaded, 1.0)
    small = plan.field_disparity(loaded.disparity).values
    large = load_large(source, loaded, plan, MOST)
    assert large.size == (HEIGHT, WIDTH)
    middles = large.disparity[SMALLER // 2 :: SMALLER, SMALLER // 2 :: SMALLER]
    assert np.ptp(small) > 0.1
    assert np.median(np.abs(middles / SMALLER - small)) < 0.03 * np.ptp(small)
    for share in (1, 50, 99):
        grown, expected = (np.percentile(values, share) for values in (large.disparity, small))
        assert grown == pytest.approx(SMALLER * expected, abs=SMALLER * 0.06 * float(np.ptp(small)))


def test_a_photo_that_another_one_took_the_place_of_is_refused(photo_path: Path) -> None:
    source = source_of(photo_path)
    loaded = load_photo(source)
    Image.new("RGB", (WIDTH, HEIGHT)).save(photo_path)
    with pytest.raises(InputError, match=r"scene\.png: was changed since it was opened; open it again"):
        load_large(source, loaded, make_plan(source, loaded, 1.0), MOST)
