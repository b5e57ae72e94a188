"""Runs the table of hostile cases, several side by side: each is a fresh process, as a user starts it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.hostile.batches import BATCH_CASES
from tests.hostile.case import Case, Ended, run_case
from tests.hostile.environments import ENVIRONMENT_CASES
from tests.hostile.inputs import INPUT_CASES
from tests.hostile.options import OPTION_CASES
from tests.hostile.outputs import OUTPUT_CASES
from tests.hostile.sandbox import make_template

CASES = (*INPUT_CASES, *OUTPUT_CASES, *OPTION_CASES, *BATCH_CASES, *ENVIRONMENT_CASES)
LEAST_CASES = 300


RunCase = Callable[[Case], Ended]


@pytest.fixture(scope="session")
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunCase]:
    """Tells how a case ended. All that are asked for are started at once, where no other worker shares the tests."""
    folder = tmp_path_factory.mktemp("hostile")
    template = folder / "template"
    make_template(template)

    def in_own_folder(case: Case) -> Ended:
        return run_case(case, template, Path(tempfile.mkdtemp(dir=folder)))

    items = [] if "PYTEST_XDIST_WORKER" in os.environ else request.session.items
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        cases = [item.callspec.params["case"] for item in items if _asks_for_case(item)]
        started = {case.name: pool.submit(in_own_folder, case) for case in cases}
        yield lambda case: started[case.name].result() if case.name in started else in_own_folder(case)


def _asks_for_case(item: pytest.Item) -> bool:
    return isinstance(item, pytest.Function) and item.originalname == "test_case"


@pytest.mark.parametrize("case", [pytest.param(case, id=case.name) for case in CASES])
def test_case(case: Case, run: RunCase) -> None:
    end = run(case)
    told = f"{' '.join(case.arguments)}\nexit {end.code}\n{end.errors}{end.output}"
    assert "Traceback" not in end.errors + end.output, told
    assert end.code == case.code, told
    assert end.changed == (), told
    if case.code != 0 and not case.is_mute:
        lines = end.errors.splitlines()
        assert len(lines) == 1, told
        assert lines[0].startswith("iibr: "), told
        assert case.says in lines[0], told


def test_there_are_many_cases_and_no_two_of_a_name() -> None:
    assert len({case.name for case in CASES}) == len(CASES) >= LEAST_CASES


def test_a_case_that_breaks_its_folder_is_found_out(tmp_path: Path) -> None:
    """The harness itself: what a command makes, changes or removes is seen."""
    make_template(tmp_path / "template")
    made = Case("", ("screenshot", "photo.png", "--disparity", "map.pfm", "--grid", "1", "-o", "new.png"), code=0)
    end = run_case(made, tmp_path / "template", tmp_path)
    assert (end.code, end.changed) == (0, ("new.png",)), end
