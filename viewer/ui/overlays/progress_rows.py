"""Long work in the notice corner, however it was started: what it is, how far it is, how long it takes, and a button
that gives it up.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from imgui_bundle import imgui

from iibr_core.runtime.time_left import about_left
from viewer.model import depth_models, viewpoint
from viewer.model.action import Action, ask, do
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import CancelGetTask
from viewer.model.state.jobs import WRITING, CancelJobTask, JobKind, JobProgress
from viewer.ui.widgets import gap, last_part, tooltip

VERBS: dict[JobKind, str] = {
    "picture": "Saving",
    "map": "Saving",
    "copy": "Copying",
    "export": "Exporting",
}

WAITING = "waiting for its turn"


@dataclass(frozen=True)
class ProgressRow:
    """key: names its button. name: what it is; words: how far it is. done: share, 0..1. cancel: None where it can no
    longer be given up.
    """

    key: str
    name: str
    words: str
    done: float
    cancel: Action | None


def progress_rows(state: AppState) -> list[ProgressRow]:
    """Of all that is under way, that which was begun by a question or a key."""
    return [*_work_on_views(state), *map(_job_row, state.jobs)]


def build_rows(rows: list[ProgressRow], layout: Layout) -> list[Action]:
    """Of each: a bar, a button, what it is, and how far it is; what was pressed comes back.

    All are of the same height, whatever their words: no button moves under the pointer as those change.
    """
    actions: list[Action] = []
    for number, row in enumerate(rows):
        if number:
            gap(layout, 2)
        imgui.progress_bar(row.done, imgui.ImVec2(-1, 4 * layout.ui_scale), "")
        imgui.begin_disabled(row.cancel is None)
        if imgui.button(f"Cancel##{row.key}") and row.cancel is not None:
            actions.append(row.cancel)
        imgui.end_disabled()
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        imgui.text(row.name)
        tooltip(row.name if imgui.get_item_rect_max().x > _right_edge() else "", layout)
        imgui.text_disabled(row.words)
    return actions


def _right_edge() -> float:
    return imgui.get_window_pos().x + imgui.get_window_size().x - imgui.get_style().window_padding.x


def job_text(job: JobProgress) -> str:
    """How far it is: "drawing, 23 %, about 8 s left"."""
    words = job.doing or WAITING
    if job.doing == WRITING:
        return words
    words += f", {round(100 * job.done)} %" if job.done else ""
    return words if job.left_s is None else f"{words}, {about_left(job.left_s)}"


def _job_row(job: JobProgress) -> ProgressRow:
    cancel = do(ask, CancelJobTask(job.id)) if job.can_be_cancelled else None
    return ProgressRow(f"job {job.id}", f"{VERBS[job.kind]} {job.name}", job_text(job), job.done, cancel)


def _work_on_views(state: AppState) -> Iterator[ProgressRow]:
    downloading = state.models.downloading
    if state.free_progress is not None:
        share = min(state.free_progress, 0.99)  # what is whole has no row
        yield ProgressRow(
            "looking",
            "Filling in what the photo does not show",
            f"{round(100 * share)} %",
            share,
            do(viewpoint.leave_camera),
        )
    if downloading is not None:
        words = f"{downloading.done:,} of {downloading.total:,} MB"
        share = downloading.done / max(downloading.total, 1)
        yield ProgressRow("download", f"Downloading {downloading.title}", words, share, do(ask, CancelGetTask()))
    model = depth_models.wanted_model(state)
    if model is not None:
        titles = {offer.name: offer.title for offer in state.models.known}
        words = f"with {titles.get(model, last_part(model))}"
        yield ProgressRow("estimate", "Estimating depth", words, 0.0, do(depth_models.give_up))
