"""A small scene that is open, and every kind of export of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from iibr_core.runtime.tiling import never
from iibr_core.types import ignore_progress
from tests.viewer.conftest import headless_with_scene
from viewer.app.exports.registry import export_path, writer_of
from viewer.app.exports.source import ExportSource
from viewer.app.headless import HeadlessViewer
from viewer.model.export_kinds import export_kind
from viewer.model.state.exporting import ExportOptions


@pytest.fixture(scope="package")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[HeadlessViewer]:
    with headless_with_scene(tmp_path_factory.mktemp("exports")) as viewer:
        yield viewer


@pytest.fixture
def source(opened: HeadlessViewer) -> ExportSource:
    """The scene as it was opened: 3x3 views of 96x64, a near square before a far wall."""
    assert opened.state.scene is not None
    return ExportSource(opened.state.scene, opened.loaded, opened.state.optics, opened.draw, ignore_progress, never)


def exported(source: ExportSource, kind: str, path: Path, optics: dict[str, Any] | None = None, **options: Any) -> Path:
    """Where it was written to."""
    source = replace(source, optics=replace(source.optics, **optics or {}))
    asked = ExportOptions(**options)
    target = export_path(export_kind(kind), path, source.scene, asked)
    writer_of(export_kind(kind))(target, source, asked)
    return target
