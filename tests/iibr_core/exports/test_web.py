import base64
import json
import re
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.choice import DepthChoice
from iibr_core.exports.kinds import EXPORTS, ExportOptions
from iibr_core.exports.source import open_for_export
from iibr_core.exports.web import make_page
from iibr_core.exports.web_gallery import write_gallery
from iibr_core.exports.web_streams import Stream, chroma_of, encode_levels, luma_of
from iibr_core.exports.web_views import MAX_TEXELS, WebForm, form_that_fits
from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.images.metadata import caption_in
from iibr_core.formats.images.open_picture import read_metadata
from iibr_core.scenes.f_numbers import equivalent_f_number
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.lens_limits import aperture_limit, first_aperture, focus_limits, focus_span
from iibr_core.scenes.scene import Source
from iibr_core.types import DISPLAY_P3, GridShape, ImageSize, InputError
from tests.iibr_core.embedded_files import packet
from tests.viewer.conftest import HEIGHT, WIDTH, write_scene

KIND = EXPORTS["web"]


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    source = Source(str(write_scene(tmp_path_factory.mktemp("scene"))), grid=GridShape(5, 5))
    return open_for_export(KIND, ExportOptions(), source, 1.0, LensChoice(), lambda scene: None, None)


def page_of(opened, **options) -> tuple[str, dict]:
    page, _ = make_page(opened, ExportOptions(**options))
    text = page.decode()
    return text, json.loads(text.partition('id="field">')[2].partition("</script>")[0])


def frames_of(text: str, field: dict, name: str, hidden: int = 0) -> list[np.ndarray]:
    """Return the levels of a stream of a page, one picture a chunk. hidden: number of hidden surfaces."""
    data = base64.b64decode(text.partition(f'id="{name}">')[2].partition("</script>")[0])
    chunks = tuple(map(tuple, field["chunks"][name]))
    assert len(chunks) == len(field["order"]) + hidden
    height, width = field["height"] * (1 + (name == "chroma")), field["width"]
    return [frame[:height, :width] for frame in decoded_levels(Stream(data, chunks))]


def decoded_levels(stream: Stream) -> list[np.ndarray]:
    """Decode a stream by its chunks, and as a file; return its levels 0 to 255."""
    import av

    decoder, frames = av.CodecContext.create("vp9", "r"), []
    for number, (begin, size) in enumerate(stream.chunks):
        packet = av.Packet(stream.data[begin : begin + size])
        (frame,) = decoder.decode(packet) + (decoder.decode(None) if number == len(stream.chunks) - 1 else [])
        assert (frame.format.name, frame.color_range, frame.width % 2, frame.height % 2) == ("yuv420p", 1, 0, 0)
        frames.append(frame.to_ndarray()[: frame.height])
    with av.open(BytesIO(stream.data)) as container:
        packets = [packet for packet in container.demux(video=0) if packet.size]
        assert [packet.is_keyframe for packet in packets] == [True, *[False] * (len(frames) - 1)]
        assert [bytes(packet) for packet in packets] == [stream.data[at : at + size] for at, size in stream.chunks]
    return [np.clip(np.rint((luma - 16.0) * 255 / 219), 0, 255) for luma in frames]


def rgb_from(luma: np.ndarray, chroma: np.ndarray) -> np.ndarray:
    blue, red = chroma[: len(luma)] - 128, chroma[len(luma) :] - 128
    channels = (luma + 1.402 * red, luma - 0.344136 * blue - 0.714136 * red, luma + 1.772 * blue)
    return np.clip(np.rint(np.stack(channels, axis=-1)), 0, 255)


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


def test_words_of_the_photo_come_only_if_asked(opened, tmp_path) -> None:
    photo = tmp_path / "photo.jpg"
    exif = Image.Exif()
    exif[0x010E], exif[0x013B], exif[0x8298] = "A <i>bridge</i>", 'Ann "A" O\'Neil', "(c) <Ann>"
    exif.get_ifd(0x8825)[1] = "N"
    title = "<dc:title><rdf:Alt><rdf:li>A &lt;b&gt;title&lt;/b&gt;</rdf:li></rdf:Alt></dc:title>"
    xmp = packet({"http://purl.org/dc/elements/1.1/ source": "x"}, title.replace("dc:", "n0:"))
    Image.new("RGB", (8, 8)).save(photo, exif=exif, xmp=xmp)
    assert caption_in(read_metadata(photo)).title == "A <b>title</b>"
    source = replace(opened, scene=replace(opened.scene, source=replace(opened.scene.source, path=str(photo))))
    plain, credited = page_of(source)[0], page_of(source, credit=True)[0]
    assert "Ann" not in plain
    assert 'alt="A &lt;i&gt;bridge&lt;/i&gt;"' in plain
    assert "<title>A &lt;b&gt;title&lt;/b&gt;</title>" in credited
    assert '<meta name="author" content="Ann &quot;A&quot; O&#x27;Neil">' in credited
    assert "(c) &lt;Ann&gt;" in credited


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


def test_the_field_is_described_and_the_first_picture_is_the_middle(opened) -> None:
    text, field = page_of(opened)
    scene = opened.scene
    assert (field["rows"], field["columns"], field["width"], field["height"], field["step"]) == (5, 5, 96, 64, 1)
    assert field["order"][0] == {"t": 0, "s": 0}
    assert {(at["t"], at["s"]) for at in field["order"]} == {(t, s) for t in range(-2, 3) for s in range(-2, 3)}
    low, high = scene.disparity_range_px
    assert field["range"] == pytest.approx([low - 0.05 * (high - low), high + 0.05 * (high - low)], abs=0.01)
    assert field["apertureLimits"] == [0, pytest.approx(aperture_limit(scene))]
    assert field["firstAperture"] == pytest.approx(first_aperture(scene))
    assert field["unitFNumber"] / 2 == pytest.approx(equivalent_f_number(scene, 2.0))
    assert field["focusLimits"] == pytest.approx(focus_limits(scene))
    letters = re.search(r'src="data:image/avif;base64,([^"]*)"', text)
    with Image.open(BytesIO(base64.b64decode(letters[1]))) as image:
        first = np.asarray(image.convert("RGB")).astype(int)
    differences = [np.abs(first - view.colors).mean() for view in opened.views()]
    assert differences[0] == min(differences) < 4


def test_the_page_opens_with_the_lens_that_is_chosen(opened):
    lens = LensChoice(
        focus=0.5, f_number=8.0, tilt=(0.2, 0.1), focus_range=0.25, blades=7, rotation=30.0, highlights=2.0
    )
    source = opened.scene.source
    _, field = page_of(open_for_export(KIND, ExportOptions(), source, 1.0, lens, lambda scene: None, None))
    optics = field["optics"]
    assert field["unitFNumber"] / optics["aperture"] == pytest.approx(8.0)
    assert (optics["focus"], optics["range"], optics["tilt"]) == (0.5, 0.25, [0.2, 0.1])
    assert (optics["shape"]["kind"], optics["shape"]["blades"], optics["shape"]["rotation_deg"]) == ("polygon", 7, 30)
    assert optics["highlights"] == pytest.approx(3 / 15)


def test_streams_hold_each_view_as_one_frame_and_what_lies_behind(opened) -> None:
    text, field = page_of(opened)
    assert page_of(opened)[0] == text, "the same views give the same page"
    luma, chroma, levels = (frames_of(text, field, name, hidden=1) for name in ("luma", "chroma", "disparity"))
    near, far = field["range"][1], field["range"][0]
    for view in opened.views(with_disparity=True):
        at = field["order"].index(dict(zip("ts", opened.scene.grid.offset(view.row, view.column))))
        decoded = rgb_from(luma[at], chroma[at])
        assert psnr(decoded, view.colors) > 36
        np.testing.assert_allclose(far + (near - far) * levels[at] / 255, view.disparity, atol=0.1)
    square = np.s_[HEIGHT // 4 : HEIGHT // 4 + 4, WIDTH // 3 : 2 * WIDTH // 3]
    np.testing.assert_allclose(
        far + (near - far) * levels[-1][square] / 255, opened.scene.disparity_range_px[0], atol=0.1
    )


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


def test_wide_colours_keep_their_numbers(tmp_path) -> None:
    photo = tmp_path / "photo.png"
    Image.new("RGB", (48, 32), (200, 80, 60)).save(photo, icc_profile=icc_profile(DISPLAY_P3))
    source = Source(str(photo), grid=GridShape(3, 3), depth=DepthChoice(start="flat"))
    text, field = page_of(open_for_export(KIND, ExportOptions(), source, 1.0, LensChoice(), lambda scene: None, None))
    assert field["colorSpace"] == "display-p3"
    with Image.open(BytesIO(base64.b64decode(re.search('avif;base64,([^"]*)', text)[1]))) as first:
        assert first.info["icc_profile"] == icc_profile(DISPLAY_P3)
        np.testing.assert_allclose(first.getpixel((24, 16)), (200, 80, 60), atol=3)
    luma, chroma = (frames_of(text, field, name) for name in ("luma", "chroma"))
    np.testing.assert_allclose(rgb_from(luma[-1], chroma[-1])[16, 24], (200, 80, 60), atol=3)


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
