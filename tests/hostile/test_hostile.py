"""The harness of the hostile cases itself."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from tests.hostile.batches import BATCH_CASES
from tests.hostile.case import DEADLINE_S, Case, CaseRunner, run_case
from tests.hostile.environments import LIMIT_CASES, PLACE_CASES
from tests.hostile.forks import KILLED, Command, Turns
from tests.hostile.inputs import INPUT_CASES
from tests.hostile.options import OPTION_CASES
from tests.hostile.outputs import OUTPUT_CASES
from tests.hostile.sandbox import make_template

CASES = (*INPUT_CASES, *OUTPUT_CASES, *OPTION_CASES, *BATCH_CASES, *PLACE_CASES, *LIMIT_CASES)
LEAST_CASES = 300
SHOT = ("screenshot", "photo.png", "--disparity", "map.pfm", "--grid", "1", "-o", "new.png")
REFUSED = Case("", ("plan", "missing.png"))


def test_there_are_many_cases_and_no_two_of_a_name() -> None:
    assert len({case.name for case in CASES}) == len(CASES) >= LEAST_CASES


def test_a_case_that_breaks_its_folder_is_found_out(tmp_path: Path) -> None:
    """What a command makes, changes or removes is seen."""
    make_template(tmp_path / "template")
    end = run_case(Case("", SHOT, code=0), tmp_path / "template", tmp_path)
    assert (end.code, end.changed) == (0, ("new.png",)), end


def test_what_a_case_does_to_a_shared_folder_is_found_out_and_no_other_sees_it(runner: CaseRunner) -> None:
    """As where a command that must be refused is not."""
    before = runner.run(REFUSED)
    end = runner.run(Case("", SHOT))
    assert (end.code, end.changed) == (0, ("new.png",)), end
    assert runner.run(REFUSED) == before


def test_a_command_that_ends_its_process_costs_no_other_its_own(tmp_path: Path) -> None:
    """As a crash does: the next one gets a new process."""
    command = Command(("plan", "missing.png"), tmp_path, {"PATH": os.environ["PATH"], "HOME": str(tmp_path)}, tmp_path)
    with Turns() as turns:
        assert turns.run(replace(command, told=tmp_path / "missing"), DEADLINE_S) == KILLED
        assert turns.run(command, DEADLINE_S) == 2
    assert "missing.png" in (tmp_path / "errors").read_text()
