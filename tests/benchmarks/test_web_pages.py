from benchmarks.pages import NAMES, rows
from tests.viewer.conftest import write_scene


def test_a_page_is_measured_beside_the_desktop(tmp_path) -> None:
    (row,) = rows("scene", write_scene(tmp_path), ["chromium"], tmp_path)
    figures = dict(zip(NAMES, row, strict=True))
    assert figures["views"] == "9"
    assert all(float(figures[name]) > 40 for name in NAMES if name.startswith(("pinhole", "aperture", "colours")))
    assert 0 <= float(figures["FLIP"]) < 0.05
    assert float(figures["memory, MB"]) > 0
