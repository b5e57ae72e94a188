"""Homes, locales and folders that are odd: each command starts in a process of its own and ends as it should."""

from __future__ import annotations

import pytest

from tests.hostile.case import Case, CaseRunner, by_name, require_good_end
from tests.hostile.environments import PLACE_CASES


@pytest.mark.parametrize("case", by_name(PLACE_CASES))
def test_case(case: Case, runner: CaseRunner) -> None:
    require_good_end(case, runner.run(case))
