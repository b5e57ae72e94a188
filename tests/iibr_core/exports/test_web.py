import json
import re

import numpy as np
import pytest

from iibr_core.exports.kinds import EXPORTS, ExportOptions
from iibr_core.exports.source import open_for_export
from iibr_core.exports.web import make_page
from iibr_core.exports.web_gallery import write_gallery
from iibr_core.exports.web_streams import chroma_of, encode_levels, luma_of
from iibr_core.exports.web_views import MAX_TEXELS, WebForm, form_that_fits
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.lens_limits import focus_limits, focus_span
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ImageSize, InputError
from tests.iibr_core.exports.readers import decoded_levels, rgb_from
from tests.viewer.conftest import write_scene

KIND = EXPORTS["web"]


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    source = Source(str(write_scene(tmp_path_factory.mktemp("scene"))), grid=GridShape(5, 5))
    return open_for_export(KIND, ExportOptions(), source, 1.0, LensChoice(), lambda scene: None, None)


def page_of(opened, **options) -> tuple[str, dict]:
    page, _ = make_page(opened, ExportOptions(**options))
    text = page.decode()
    return text, json.loads(text.partition('id="field">')[2].partition("</script>")[0])


def psnr(one: np.ndarray, other: np.ndarray) -> float:
    return float(10 * np.log10(255**2 / max(np.mean((one - other.astype(float)) ** 2), 1e-9)))


def test_a_budget_takes_quality_then_views_then_size(opened) -> None:
    budget, forms, parallax = None, [], []
    while not forms or forms[-1][0] == -1.0:
        page, views = make_page(opened, ExportOptions(budget=budget))
        assert budget is None or len(page) <= budget
        forms.append((-views.form.scale, views.form.every, -views.form.quality))
        parallax.append(np.array(views.range_px) / views.size.width)
        budget = len(page) - 1 if len(forms) < 3 else len(page) * 19 // 20
    assert forms[:3] == [(-1.0, 1, -82), (-1.0, 1, -65), (-1.0, 1, -48)]
    assert forms == sorted(forms)
    np.testing.assert_allclose(parallax, parallax[:1] * len(parallax), err_msg="as much parallax at half the size")
    field = json.loads(page.decode().partition('id="field">')[2].partition("</script>")[0])
    assert field["focusLimits"] == pytest.approx(
        [views.size.width / 96 * limit for limit in focus_limits(opened.scene)]
    )
    assert field["rangeLimits"] == pytest.approx([0, views.size.width / 96 * focus_span(opened.scene)])
    with pytest.raises(InputError, match="budget"):
        page_of(opened, budget=10_000)


def test_the_gallery_lists_pages_and_is_replaced(opened, tmp_path) -> None:
    text, _ = page_of(opened)
    for name in ("a#1.html", "<b>.html", "index.html"):
        (tmp_path / name).write_text(text.replace("<title>scene", f"<title>{name.replace('<', '&lt;')}"), "utf-8")
    first = write_gallery(tmp_path, ["a#1.html", "index.html", "gone.html"])
    assert first.name == "index-of-pages.html"
    (tmp_path / "index.html").unlink()
    path = write_gallery(tmp_path, ["a#1.html", "<b>.html"])
    assert path.name == "index.html"
    listed = write_gallery(tmp_path, ["a#1.html", "<b>.html"]).read_text("utf-8")
    assert re.findall(r'<a href="([^"]*)">', listed) == ["%3Cb%3E.html", "a%231.html"]
    assert "<b>" not in listed
    pictures = re.findall(r'src="(data:image/avif;base64,[^"]*)"', listed)
    assert len(pictures) == 2
    (tmp_path / "index.html").write_text("somebody's", "utf-8")
    with pytest.raises(InputError, match="no gallery"):
        write_gallery(tmp_path, ["a#1.html"])


@pytest.mark.parametrize("size", [(1, 7), (97, 211)])
def test_sharp_edges_between_colours_stay(size) -> None:
    """Red meets blue, and thin green lines lie on grey, at every pixel: halved chroma would blur them."""
    picture = np.full((*size, 3), 128, np.uint8)
    picture[:, ::2], picture[:, 1::4] = (200, 20, 20), (20, 20, 200)
    views = {"luma": luma_of(picture), "chroma": chroma_of(picture)}
    streams = {name: encode_levels([levels] * 3, ImageSize(*levels.shape), 10) for name, levels in views.items()}
    luma, chroma = ([frame[: len(views[name])] for frame in decoded_levels(streams[name])] for name in views)
    for y, c in zip(luma, chroma, strict=True):
        assert psnr(rgb_from(y[:, : size[1]], c[:, : size[1]]), picture) > 36


def test_fields_that_browsers_cannot_hold_lose_views_then_size() -> None:
    for grid, size in ((GridShape(9, 9), ImageSize(1224, 1632)), (GridShape(1, 1), ImageSize(8192, 8192)),
                       (GridShape(33, 33), ImageSize(64, 64)), (GridShape(2, 1), ImageSize(1, 1))):  # fmt: skip
        form = form_that_fits(grid, size, True)
        height, width = form.size_of(size)
        count = len(range(0, grid.rows, form.every)) * len(range(0, grid.columns, form.every))
        assert count * height * width <= MAX_TEXELS
        assert count <= 300
    assert form == WebForm()
    form = form_that_fits(GridShape(5, 9), ImageSize(1224, 1632), True, keeps_views=True)
    assert form.every == 1, "for headsets views are smaller rather than fewer"
    assert 0.99 * MAX_TEXELS <= 45 * np.prod(form.size_of(ImageSize(1224, 1632))) <= MAX_TEXELS
