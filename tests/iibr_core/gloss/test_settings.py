from dataclasses import replace

import pytest

from iibr_core.gloss.settings import GlossLight


def test_a_smaller_light_of_the_same_strength_is_brighter():
    wide = GlossLight(radius_deg=4.0)
    narrow = replace(wide, radius_deg=2.0)
    assert narrow.radiance[0] == pytest.approx(4 * wide.radiance[0], rel=0.01)


def test_a_light_needs_a_direction():
    with pytest.raises(ValueError, match="direction"):
        GlossLight(direction=(0.0, 0.0, 0.0))
