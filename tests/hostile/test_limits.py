"""Streams, threads, memory and files that are short: each command starts in a process of its own."""

from __future__ import annotations

import pytest

from tests.hostile.case import Case, CaseRunner, by_name, require_good_end
from tests.hostile.environments import LIMIT_CASES


@pytest.mark.parametrize("case", by_name(LIMIT_CASES))
def test_case(case: Case, runner: CaseRunner) -> None:
    require_good_end(case, runner.run(case))
