"""Options all tests share."""

from __future__ import annotations

import pytest
from hypothesis import settings

# The first example of a test may compile a kernel, which takes seconds; nothing is timed in a test anyway.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--regenerate-golden", action="store_true", help="write the golden images anew, then look at them")


@pytest.fixture
def regenerate_golden(request: pytest.FixtureRequest) -> bool:
    return bool(request.config.getoption("--regenerate-golden"))
