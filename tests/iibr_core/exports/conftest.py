"""Open scenes, a plain one and two that are hard in every way, and a function that exports them."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from numpy.typing import NDArray

from iibr_core.exports.kinds import ExportOptions, export_kind, export_path
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource, write_export
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape
from tests.iibr_core.hard_scenes import write_hard_field, write_hard_photo
from tests.viewer.conftest import write_scene
from viewer.display.offscreen import OffscreenScene


@pytest.fixture(scope="package")
def opened(tmp_path_factory) -> Iterator[ExportSource]:
    source = Source(str(write_scene(tmp_path_factory.mktemp("exports"))), grid=GridShape(3, 3))
    with drawn(source) as opened:
        yield opened


@contextmanager
def drawn(given: Source, depth_strength: float = 1.0) -> Iterator[ExportSource]:
    """Open a scene that draws in its own GL context, whichever was made last: several scenes are open at a time."""
    with OffscreenScene() as drawer:
        source = drawer.open_for_export(given, depth_strength, LensChoice(), lambda scene: None)

        def draw(settings: RenderSettings) -> NDArray[Any]:
            with drawer.gl.ctx:
                return source.draw(settings)

        yield replace(source, draw=draw)


@pytest.fixture
def source(opened) -> ExportSource:
    """The opened scene: 3x3 views of 96x64, a near square before a far wall."""
    return replace(opened, centre=None)


@pytest.fixture(scope="package")
def hard(tmp_path_factory) -> Iterator[dict[str, ExportSource]]:
    """The field and the photo of `hard_scenes`; what does not move of the photo lies between wall and square."""
    folder = tmp_path_factory.mktemp("hard")
    given = write_hard_field(folder / "field"), replace(write_hard_photo(folder), focus_disparity=0.24)
    with ExitStack() as stack:
        scenes = [stack.enter_context(drawn(source, strength)) for source, strength in zip(given, (1.0, 3.0))]
        yield dict(zip(("field", "photo"), scenes))


def with_metres(source: ExportSource, nearest: float, farthest: float) -> ExportSource:
    """Return a photo's source where these distances are known of its nearest and farthest disparity."""
    plan = source.plan()
    low, high = (value / plan.disparity_scale + plan.disparity_zero for value in plan.disparity_range_px)
    slope = (1 / nearest - 1 / farthest) / (high - low)
    return replace(source, scene=replace(source.scene, inverse_metres=(slope, 1 / nearest - slope * high)))


def exported(source: ExportSource, kind: str, path: Path, optics: dict[str, Any] | None = None, **options: Any) -> Path:
    source = replace(source, optics=replace(source.optics, **optics or {}))
    chosen = ExportOptions(**options)
    target = export_path(export_kind(kind), path, source.scene, chosen)
    write_export(export_kind(kind), target, source, chosen)
    return target
