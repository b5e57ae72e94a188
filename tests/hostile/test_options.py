"""Options that make no sense: one line, nothing harmed."""

from __future__ import annotations

import pytest

from tests.hostile.case import Case, CaseRunner, by_name, require_good_end
from tests.hostile.options import OPTION_CASES


@pytest.mark.parametrize("case", by_name(OPTION_CASES))
def test_case(case: Case, runner: CaseRunner) -> None:
    require_good_end(case, runner.run(case))
