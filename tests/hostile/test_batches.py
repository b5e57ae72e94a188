"""`iibr batch`: one line, nothing harmed."""

from __future__ import annotations

import pytest

from tests.hostile.batches import BATCH_CASES
from tests.hostile.case import Case, CaseRunner, by_name, require_good_end


@pytest.mark.parametrize("case", by_name(BATCH_CASES))
def test_case(case: Case, runner: CaseRunner) -> None:
    require_good_end(case, runner.run(case))
