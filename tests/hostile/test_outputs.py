"""What is written may not be there: one line, nothing harmed."""

from __future__ import annotations

import pytest

from tests.hostile.case import Case, CaseRunner, by_name, require_good_end
from tests.hostile.outputs import OUTPUT_CASES


@pytest.mark.parametrize("case", by_name(OUTPUT_CASES))
def test_case(case: Case, runner: CaseRunner) -> None:
    require_good_end(case, runner.run(case))
