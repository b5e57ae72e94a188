"""Runs hostile cases, those of one worker in one folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.hostile.case import CaseRunner
from tests.hostile.sandbox import make_template


@pytest.fixture(scope="session")
def runner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CaseRunner]:
    """Tells how a case ends."""
    folder = tmp_path_factory.mktemp("hostile")
    make_template(folder / "template")
    with CaseRunner(folder / "template", folder) as made:
        yield made
