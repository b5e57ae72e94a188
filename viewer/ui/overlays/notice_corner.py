"""The lower left corner of the picture: progress of long work, the newest notice, an offer of better depth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from imgui_bundle import imgui

from iibr_core.runtime.time_left import about_left
from viewer.model import depth_models, messages, opening, viewpoint
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.commands import BY_NAME
from viewer.model.depth_models import ModelOffer
from viewer.model.layout import MARGIN, STRIP_GAP, Layout
from viewer.model.messages import Notice
from viewer.model.saving import WRITING, JobKind, JobProgress
from viewer.model.tasks import CancelJobTask, ChooseTask, PlainTask, ask
from viewer.ui.overlays.prompt_rows import CARD_FLAGS, button_rows, file_offers
from viewer.ui.style import palette_of
from viewer.ui.widgets import button, colored, gap, quiet, scale, tooltip

NOTICE_WIDTH = 420.0
MIN_WIDTH, MIN_HEIGHT = 160.0, 40.0
VERBS: dict[JobKind, str] = {"picture": "Saving", "map": "Saving", "copy": "Copying", "export": "Exporting"}


class ProgressRow(NamedTuple):
    """Work in progress. key: identifies its button. done: share, 0..1. cancel: None while it cannot be cancelled."""

    key: str
    name: str
    words: str
    done: float
    cancel: Action | None


def notices(state: AppState, layout: Layout) -> list[Action]:
    """Draw the corner; return the actions of the buttons that were pressed."""
    rows, offer = [*_work_on_views(state), *job_rows(state.jobs)], depth_models.offered_model(state)
    if not (state.notices or rows or offer) or not _place(layout):
        return []
    imgui.begin("notices", None, CARD_FLAGS)
    if state.prompt is not None:  # the buttons of a prompt must be seen
        imgui.internal.bring_window_to_display_back(imgui.internal.get_current_window())
    actions = build_rows(rows)
    if state.notices:
        actions += _notice(state.notices[-1], state)
    if offer is not None:
        actions += _offer(offer, state.models.smallest)
    imgui.end()
    return actions


def _place(layout: Layout) -> bool:
    """Place the next window in the corner; return whether there is room."""
    margin = MARGIN * layout.ui_scale
    right, bottom = layout.panel.x - margin, layout.window.height - margin
    if layout.strip_across is not None and layout.strip_down is not None:
        right, bottom = layout.strip_down.x - STRIP_GAP * layout.ui_scale, layout.strip_across.y - margin / 2
    elif layout.status is not None:
        bottom = layout.status.y
    elif layout.filmstrip is not None:
        bottom = layout.filmstrip.y - margin / 2
    if right - margin < MIN_WIDTH * layout.ui_scale:  # over the panel, where there is no room beside it
        right = layout.window.width - margin
    width = min(NOTICE_WIDTH * layout.ui_scale, right - margin)
    imgui.set_next_window_pos(imgui.ImVec2(margin, bottom), 0, imgui.ImVec2(0, 1))
    height = max(bottom - margin / 2, MIN_HEIGHT * layout.ui_scale)
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, height))
    return width > 0


def _notice(notice: Notice, state: AppState) -> list[Action]:
    """Draw a notice, its offers, and the number of those that wait behind it."""
    palette, others = palette_of(state.preferences.theme), len(state.notices) - 1
    actions: list[Action] = [do(messages.dismiss, notice)] if imgui.button("×") else []
    imgui.same_line()
    imgui.begin_group()
    imgui.align_text_to_frame_padding()
    colored(notice.text, imgui.ImVec4(*(palette.error if notice.is_error else palette.text)))
    offers: list[tuple[str, Action]] = [(name, BY_NAME[name].action(state)) for name in notice.commands]
    if notice.failed_model:
        offers.append(("Try again", do(depth_models.use_model, notice.failed_model)))
        offers.append(("Choose a model file…", do(ask, ChooseTask("model"))))
    offers += [("Details", do(messages.show_details, notice))] if notice.details else []
    offers += file_offers(notice.path) if notice.path else []
    offers += [("Use its settings", do(opening.take_settings, notice.offer))] if notice.offer is not None else []
    offers += [(f"Close all ({others + 1})", do(messages.dismiss))] if others else []
    actions += button_rows(offers)
    if notice.path:
        imgui.same_line()
        if imgui.button("Copy path"):
            imgui.set_clipboard_text(notice.path)
    imgui.end_group()
    return actions


def _offer(model: ModelOffer, smallest: ModelOffer | None) -> list[Action]:
    """Draw the offer of better depth in place of a guess. smallest: model for a slow line."""
    words, verb = f"Depth is guessed. {model.title} is here.", "Estimate depth"
    if model.lacks:
        words = f"Depth is guessed. {model.title}: {model.lacks}"
    elif not model.is_here:
        words = f"Depth is guessed. {model.title}: {model.megabytes:,} MB, {model.licence}, {model.host}"
        verb = "Get better depth"
    actions: list[Action] = [do(depth_models.show_offer, False)] if imgui.button("×##offer") else []
    imgui.same_line()
    imgui.begin_group()
    imgui.align_text_to_frame_padding()
    quiet(words)
    offers = [] if model.lacks else [(verb, do(depth_models.get_depth))]
    if smallest is not None and not model.is_here and smallest.megabytes < model.megabytes:
        offers.append((f"or {smallest.megabytes} MB", do(depth_models.use_model, smallest.name)))
    actions += button_rows([*offers, ("Don't offer again", do(depth_models.offer_no_more))])
    imgui.end_group()
    return actions


def build_rows(rows: Sequence[ProgressRow]) -> list[Action]:
    """Draw work in progress; return the actions of the buttons that were pressed.

    All rows have the same height, so that no button moves while the words change.
    """
    actions: list[Action] = []
    for number, row in enumerate(rows):
        if number:
            gap()
        imgui.progress_bar(row.done, imgui.ImVec2(-1, 4 * scale()), "")
        if button(f"Cancel##{row.key}", is_enabled=row.cancel is not None) and row.cancel is not None:
            actions.append(row.cancel)
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        imgui.text(row.name)
        right = imgui.get_window_pos().x + imgui.get_window_size().x - imgui.get_style().window_padding.x
        tooltip(row.name if imgui.get_item_rect_max().x > right else "")
        imgui.text_disabled(row.words)
    return actions


def job_rows(jobs: Sequence[JobProgress]) -> list[ProgressRow]:
    """Return the rows of saves, copies and exports."""
    rows = []
    for job in jobs:
        cancel = do(ask, CancelJobTask(job.id)) if job.can_be_cancelled else None
        rows.append(ProgressRow(f"job {job.id}", f"{VERBS[job.kind]} {job.name}", job_text(job), job.done, cancel))
    return rows


def job_text(job: JobProgress) -> str:
    """Return the progress in words: "drawing, 23 %, about 8 s left"."""
    words = job.doing or "waiting for its turn"
    if job.doing == WRITING:
        return words
    words += f", {round(100 * job.done)} %" if job.done else ""
    return words if job.left_s is None else f"{words}, {about_left(job.left_s)}"


def _work_on_views(state: AppState) -> Iterator[ProgressRow]:
    downloading, model = state.models.downloading, depth_models.wanted_model(state)
    if state.free_progress is not None:
        share = min(state.free_progress, 0.99)  # finished work has no row
        words, leave = f"{round(100 * share)} %", do(viewpoint.leave_camera)
        yield ProgressRow("looking", "Filling in what the photo does not show", words, share, leave)
    if downloading is not None:
        words = f"{downloading.done:,} of {downloading.total:,} MB"
        share = downloading.done / max(downloading.total, 1)
        yield ProgressRow(
            "download", f"Downloading {downloading.title}", words, share, do(ask, PlainTask("stop download"))
        )
    if model is not None:
        words = f"with {depth_models.model_named(state.models, model).title}"
        yield ProgressRow("estimate", "Estimating depth", words, 0.0, do(depth_models.give_up))
