"""The README's figures stand in reports, reports say what made them, and the check notices where they don't."""

from __future__ import annotations

import pytest

from benchmarks import readme_figures
from benchmarks.harness.report import current_commit
from benchmarks.readme_figures import (
    ROOT,
    faults_of_report,
    figures_of,
    figures_without_report,
    has_history,
    read_reports,
    stands_in,
)

README = """# A name

0.5 GB to install.

## Speed and accuracy

On 2 cores, 81 views of 512x512.

| what | PSNR, dB |
| --- | --- |
| fast ● | +0.13 |
| teddy, moebius | 26.89, 26.8 dB (K = 3) |
| cancelled | ends within 25 ms, in 7 to 9 s |

## Limits

It takes 99 s.
"""


def test_figures_are_what_is_measured() -> None:
    assert [f.values for f in figures_of(README)] == [("+0.13",), ("26.89", "26.8"), ("25", "7", "9")]


def test_a_readme_without_the_section_is_refused() -> None:
    with pytest.raises(ValueError, match="Speed and accuracy"):
        list(figures_of("# A name\n"))


@pytest.mark.parametrize(
    ("figure", "numbers", "stands"),
    [
        ("4.2", (4.15,), True),
        ("4.2", (4.26,), False),
        ("+0.13", (-0.13,), False),
        ("7", (7.4,), True),
        ("7", (), False),
    ],
)
def test_a_figure_is_a_number_of_the_report_rounded(figure: str, numbers: tuple[float, ...], stands: bool) -> None:
    assert stands_in(figure, numbers) == stands


def test_figures_of_a_row_stand_under_one_heading() -> None:
    row = "## Speed and accuracy\n\n| teddy, moebius | 26.89, 26.82 dB |\n"
    assert not figures_without_report(row, {"a": "# One\n\n26.892 and 26.82\n"})
    (missing,) = figures_without_report(row, {"a": "# One\n\n26.892\n\n# Two\n\n26.82, 3\n"})
    assert len(missing.values) == 1


def test_every_figure_of_the_readme_stands_in_a_report() -> None:
    missing = figures_without_report((ROOT / "README.md").read_text("utf-8"), read_reports())
    assert not missing, "\n".join(f"{f.line}: no report has {', '.join(f.values)}" for f in missing)


@pytest.mark.skipif(not has_history(), reason="the folder holds no history of commits to look reports up in")
@pytest.mark.parametrize("name", read_reports())
def test_every_report_says_what_made_it(name: str) -> None:
    assert not list(faults_of_report(name, read_reports()[name]))


@pytest.mark.skipif(not has_history(), reason="the folder holds no history of commits to look reports up in")
def test_a_report_of_another_core_has_to_say_what_differs(monkeypatch: pytest.MonkeyPatch) -> None:
    newest = current_commit().partition(" ")[0]
    assert not list(faults_of_report("new", f"Made by `x` at commit {newest}.\n"))
    assert list(faults_of_report("nameless", "Made by `x`.\n")) == ["nameless: names no commit that it was made at"]
    assert list(faults_of_report("lost", f"Made at commit {'0' * 12}.\n")) == [
        f"lost: commit {'0' * 12} is no ancestor of this one"
    ]
    assert list(faults_of_report("unclean", f"Made at commit {newest} (with changes).\n"))
    monkeypatch.setattr(readme_figures, "rooms_changed_since", lambda commit: {"depth"})
    old = f"Made at commit {newest}.\n"
    assert list(faults_of_report("old", old)) == [
        f'old: depth changed since commit {newest}, and no paragraph "Since then" says what differs'
    ]
    assert not list(faults_of_report("old", old + "\nSince then depth finds thin things, which no figure here asks.\n"))
