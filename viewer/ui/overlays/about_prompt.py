"""The prompt about the program: version, licence, and pages in the web, which only a button opens."""

from __future__ import annotations

from imgui_bundle import imgui

from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.tasks import ShowFileTask, ask
from viewer.ui.overlays.prompt_rows import button_rows
from viewer.ui.widgets import gap, quiet
from viewer.version import program_commit, program_licence, program_pages, program_version


def about_prompt() -> list[Action]:
    """Draw what the program is, and a button for each page; return the actions of the pressed ones."""
    imgui.text(f"iibr {program_version()}")
    quiet(f"Commit {program_commit()}, licence {program_licence()}")
    quiet("The program never looks for a newer version by itself.")
    gap()
    pages = program_pages()
    return button_rows(
        [
            ("Look for a newer version", do(ask, ShowFileTask(pages["Releases"]))),
            ("Libraries and licences", do(ask, ShowFileTask(f"{pages['Documentation']}/licences.md"))),
            ("Close", do(messages.show_prompt, None)),
        ]
    )
