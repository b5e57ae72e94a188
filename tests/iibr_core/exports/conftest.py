"""A small open scene, and a function that exports it."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from iibr_core.exports.kinds import ExportOptions, export_kind, export_path
from iibr_core.exports.source import ExportSource, write_export
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape
from tests.viewer.conftest import write_scene
from viewer.display.offscreen import OffscreenScene


@pytest.fixture(scope="package")
def opened(tmp_path_factory) -> Iterator[ExportSource]:
    source = Source(str(write_scene(tmp_path_factory.mktemp("exports"))), grid=GridShape(3, 3))
    with OffscreenScene() as drawer:
        opened = drawer.open_for_export(source, 1.0, LensChoice(), lambda scene: None)
        yield opened


@pytest.fixture
def source(opened) -> ExportSource:
    """The opened scene: 3x3 views of 96x64, a near square before a far wall."""
    return replace(opened, centre=None)


def exported(source: ExportSource, kind: str, path: Path, optics: dict[str, Any] | None = None, **options: Any) -> Path:
    source = replace(source, optics=replace(source.optics, **optics or {}))
    chosen = ExportOptions(**options)
    target = export_path(export_kind(kind), path, source.scene, chosen)
    write_export(export_kind(kind), target, source, chosen)
    return target
