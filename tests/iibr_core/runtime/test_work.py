"""Progress of parts of a job counts in the whole, also of parts whose amount of work is unknown."""

from iibr_core.runtime.work import part_of_job, report_progress, watched


def test_parts_count_in_the_whole_job() -> None:
    reports: list[tuple[float, float, str]] = []
    with watched(lambda *now: reports.append(now)), part_of_job(1, 2, 4):
        report_progress(0, 0, "looking")
        with part_of_job(1, 1, 2):
            report_progress(3, 6, "making")
    assert reports == [(1, 4, "looking"), (2.5, 4, "making")]
