"""What is read is not what it seems: one line, nothing harmed."""

from __future__ import annotations

import pytest

from tests.hostile.case import Case, CaseRunner, by_name, require_good_end
from tests.hostile.inputs import INPUT_CASES


@pytest.mark.parametrize("case", by_name(INPUT_CASES))
def test_case(case: Case, runner: CaseRunner) -> None:
    require_good_end(case, runner.run(case))
