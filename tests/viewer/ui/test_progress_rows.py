"""What stands in the notice corner while something takes long."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.action import ask, do
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import CancelGetTask, DepthModels, Downloading
from viewer.model.state.jobs import STOPPING, WRITING, CancelJobTask, JobProgress
from viewer.ui.overlays.progress_rows import progress_rows


def test_each_job_has_a_row_and_a_cancel_of_its_own() -> None:
    jobs = [JobProgress(7, "export", "a.gif", "drawing frames", 0.5), JobProgress(9, "copy", "the picture")]
    rows = progress_rows(AppState(jobs=tuple(jobs)))
    assert [row.name for row in rows] == ["Exporting a.gif", "Copying the picture"]
    assert [row.cancel for row in rows] == [do(ask, CancelJobTask(7)), do(ask, CancelJobTask(9))]
    for doing in (WRITING, STOPPING):
        (row,) = progress_rows(AppState(jobs=(replace(jobs[0], doing=doing),)))
        assert row.cancel is None


def test_a_download_has_the_same_row() -> None:
    (row,) = progress_rows(AppState(models=DepthModels(downloading=Downloading("A model", 25, 100))))
    assert (row.name, row.words, row.done) == ("Downloading A model", "25 of 100 MB", 0.25)
    assert row.cancel == do(ask, CancelGetTask())
