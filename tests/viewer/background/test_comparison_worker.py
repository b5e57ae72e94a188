"""Work beside the worker's: pairs of views and their scores, entropy; what is kept, what is stopped."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from iibr_core.evaluation.metrics import psnr
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import read_stored_view, read_views
from iibr_core.formats.light_fields.write import write_light_field
from iibr_core.inpainting.registry import INPAINTERS
from iibr_core.method.light_field import complete_rays, generate
from iibr_core.method.occlusion import view_entropy
from iibr_core.method.plan import plan_for_viewing, plan_literal
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.view import Renderer
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.scenes.photo import load_photo
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError
from tests.iibr_core import red_inpainter
from tests.viewer.conftest import write_scene
from viewer.background.comparison import ComparisonInputs, EntropyReady, PairReady, PairScored
from viewer.background.comparison_job import ComparisonJob
from viewer.background.comparison_worker import ComparisonResult, ComparisonWorker
from viewer.background.job_threads import Failed
from viewer.model.inspection_request import InspectionRequest
from viewer.model.state.inspection import GroundTruth

GRID = GridShape(3, 3)
DEADLINE_S = 60.0


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> ComparisonInputs:
    loaded = load_photo(Source(str(write_scene(tmp_path_factory.mktemp("request")))))
    return ComparisonInputs(loaded, plan_for_viewing(loaded.photo, loaded.disparity))


@pytest.fixture
def truth(inputs: ComparisonInputs, tmp_path: Path) -> GroundTruth:
    """The light field that the photo gives at its disparity as it is."""
    loaded = inputs.loaded
    assert loaded is not None
    plan = plan_literal(loaded.photo, loaded.disparity, GRID)
    views = generate(loaded.photo, plan.field_disparity(loaded.disparity), plan)
    write_light_field(tmp_path / "truth", "hci", GRID, views, 100.0, "truth")
    height, width = loaded.photo.size
    return GroundTruth(str(tmp_path / "truth"), "truth", GRID, width, height)


def never() -> bool:
    return False


def test_entropy_is_that_of_the_weights_and_is_only_made_on_request(inputs: ComparisonInputs) -> None:
    request = InspectionRequest(1, "entropy", (0, 0))
    (seen,) = ComparisonJob().results_of(request, inputs)
    assert isinstance(seen, EntropyReady)
    loaded, plan = inputs.loaded, inputs.plan
    assert loaded is not None
    assert plan is not None
    rays = complete_rays(loaded.photo, plan.field_disparity(loaded.disparity), plan, Renderer(shipped_transformer()))
    expected = view_entropy(rays, plan.grid.offset(0, 0))
    assert 0 <= expected.min() < expected.max() <= 1
    np.testing.assert_allclose(seen.entropy, expected * 255, atol=0.5)
    middle = next(ComparisonJob().results_of(replace(request, view=plan.grid.centre), inputs))
    assert isinstance(middle, EntropyReady)
    assert not middle.entropy.any(), "every ray of the middle view is the photo's own"


def test_holes_are_filled_as_in_the_scene_s_own_views(
    monkeypatch: pytest.MonkeyPatch, inputs: ComparisonInputs, truth: GroundTruth
) -> None:
    monkeypatch.setitem(INPAINTERS, "red", red_inpainter.ENTRY)
    loaded, view = inputs.loaded, (0, 1)
    assert loaded is not None
    plan = plan_literal(loaded.photo, loaded.disparity, GRID)
    request = InspectionRequest(1, "truth", view, truth)
    (pair,) = ComparisonJob().results_of(request, replace(inputs, inpaint="red"))
    (usual,) = ComparisonJob().results_of(request, inputs)
    assert isinstance(pair, PairReady)
    assert isinstance(usual, PairReady)
    views = generate(loaded.photo, plan.field_disparity(loaded.disparity), plan, inpaint="red")
    expected = next(update.colors for update in views if (update.row, update.column) == view)
    np.testing.assert_array_equal(pair.left, expected)
    assert (pair.left != usual.left).any()


def test_what_is_made_at_the_places_of_the_truth_is_the_truth_itself(
    inputs: ComparisonInputs, truth: GroundTruth
) -> None:
    """The plan for viewing has its own scale and focus; views beside ground truth are made at the truth's."""
    for view in ((0, 0), (1, 2), (1, 1)):
        pair, scored = ComparisonJob().results_of(InspectionRequest(1, "truth", view, truth, is_scored=True), inputs)
        assert isinstance(pair, PairReady)
        np.testing.assert_array_equal(pair.right, read_stored_view(open_light_field(Path(truth.path)), *view))
        assert isinstance(scored, PairScored)
        assert (scored.psnr_db, scored.flip) == (math.inf, 0)


def test_a_stored_view_is_held_against_the_truth_as_it_is(truth: GroundTruth) -> None:
    stored = np.full((truth.height, truth.width, 3), 100, np.uint8)
    request = InspectionRequest(1, "truth", (2, 0), truth, is_scored=True)
    pair, scored = ComparisonJob().results_of(request, ComparisonInputs(stored=stored))
    assert isinstance(pair, PairReady)
    assert isinstance(scored, PairScored)
    np.testing.assert_array_equal(pair.left, stored)
    assert scored.psnr_db == psnr(stored, read_stored_view(open_light_field(Path(truth.path)), 2, 0))


def test_a_pair_is_made_once_and_scored_when_asked(inputs: ComparisonInputs, truth: GroundTruth) -> None:
    job, request = ComparisonJob(), InspectionRequest(1, "truth", (0, 0), truth)
    (pair,) = job.results_of(request, inputs)
    assert isinstance(pair, PairReady)
    again, scored = job.results_of(replace(request, is_scored=True), inputs)
    assert again is pair, "told again, for the first may have been dropped, but not made again"
    assert isinstance(scored, PairScored)


def test_a_look_that_is_not_wanted_any_more_stops(inputs: ComparisonInputs, truth: GroundTruth) -> None:
    with pytest.raises(Cancelled), stoppable(lambda: True):
        list(ComparisonJob().results_of(InspectionRequest(1, "truth", (0, 0), truth), inputs))


def test_truth_that_changed_on_disk_is_an_input_error(inputs: ComparisonInputs, truth: GroundTruth) -> None:
    request = InspectionRequest(1, "truth", (0, 0), truth)
    for path in Path(truth.path).glob("input_Cam*.png"):
        write_image(path, np.zeros((4, 4, 3), np.uint8))
    with pytest.raises(InputError, match="changed"):
        list(ComparisonJob().results_of(request, inputs))
    next(Path(truth.path).glob("input_Cam000.png")).unlink()
    with pytest.raises(InputError, match="input_Cam000"):
        list(ComparisonJob().results_of(request, inputs))


def test_one_view_of_a_folder_is_the_one_read_with_all_others(truth: GroundTruth) -> None:
    field = open_light_field(Path(truth.path))
    for update in read_views(field)[1]:
        np.testing.assert_array_equal(read_stored_view(field, update.row, update.column), update.colors)
    with pytest.raises(InputError, match="3x3"):
        read_stored_view(field, 3, 0)
    with pytest.raises(InputError, match="3x3"):
        read_stored_view(field, 0, -1)


@pytest.fixture
def comparisons() -> Iterator[tuple[ComparisonWorker, Callable[[type[ComparisonResult]], ComparisonResult]]]:
    """The thread, and a way to wait for what it finds."""
    woken = threading.Event()
    thread = ComparisonWorker(woken.set)

    def found(kind: type[ComparisonResult]) -> ComparisonResult:
        while True:
            assert woken.wait(DEADLINE_S)
            woken.clear()
            while (result := thread.next_result()) is not None:
                if isinstance(result, kind):
                    return result

    yield thread, found
    thread.close()


def test_the_newest_look_wins(
    inputs: ComparisonInputs, comparisons: tuple[ComparisonWorker, Callable[[type[ComparisonResult]], ComparisonResult]]
) -> None:
    thread, found = comparisons
    requests = [InspectionRequest(1, "entropy", (0, column)) for column in range(3)]
    for request in requests:
        thread.want(request, inputs)
    assert found(EntropyReady).request == requests[-1]
    thread.want(requests[0], None)
    assert thread.wanted == requests[-1], "without inputs nothing changes"
    thread.want(None, None)
    assert thread.next_result() is None


def test_what_fails_is_told_in_one_line(
    inputs: ComparisonInputs,
    truth: GroundTruth,
    comparisons: tuple[ComparisonWorker, Callable[[type[ComparisonResult]], ComparisonResult]],
) -> None:
    thread, found = comparisons
    thread.want(InspectionRequest(1, "truth", (0, 0), replace(truth, path="nowhere")), inputs)
    failed = found(Failed)
    assert isinstance(failed, Failed)
    assert failed.message.startswith("nowhere")
    assert "\n" not in failed.message


def test_the_middle_view_is_the_photo_whatever_its_disparity(inputs: ComparisonInputs, truth: GroundTruth) -> None:
    """Rays of torn disparity cover each other even where nothing moves; yet nothing is to be found out there."""
    loaded = inputs.loaded
    assert loaded is not None
    torn = np.random.default_rng(5).uniform(-30, 30, loaded.photo.size).astype(np.float32)
    loaded = replace(loaded, disparity=replace(loaded.disparity, values=torn))
    request = InspectionRequest(1, "truth", GRID.centre, truth, is_scored=True)
    pair, scored = ComparisonJob().results_of(request, replace(inputs, loaded=loaded))
    assert isinstance(pair, PairReady)
    assert isinstance(scored, PairScored)
    np.testing.assert_array_equal(pair.left, np.rint(loaded.photo.pixels * 255))
    assert (scored.psnr_db, scored.flip) == (math.inf, 0)
