"""Thread beside the scene worker's: a view to compare with the truth, its score, the entropy of weights.

The newest request wins. Rays and images are kept only as long as something is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from viewer.background.comparison import ComparisonFinding, ComparisonInputs, ComparisonRequest
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.model.inspection_request import InspectionRequest

if TYPE_CHECKING:
    from viewer.background.comparison_job import ComparisonJob

ComparisonResult = ComparisonFinding | Failed[InspectionRequest | None]


class ComparisonWorker(JobThread[ComparisonRequest, ComparisonResult]):
    """Carries out the newest request. wanted: the request at work or done."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """Start the thread. wake: called in it for every finding."""
        super().__init__("iibr-comparison", wake, self._compare, lambda asked, message: Failed(asked.id, message))
        self.wanted: InspectionRequest | None = None
        self._comparison_job: ComparisonJob | None = None

    def want(self, request: InspectionRequest | None, inputs: ComparisonInputs | None) -> None:
        """Answer this request instead of the one before; nothing happens for the same one, or without inputs."""
        if request == self.wanted or (request is not None and inputs is None):
            return
        self.wanted = request
        self.submit(ComparisonRequest(request, inputs))

    def _compare(self, job: Job[ComparisonRequest, ComparisonResult]) -> Iterator[ComparisonResult]:
        request, inputs = job.request.id, job.request.inputs
        if request is None or inputs is None:
            self._comparison_job = None
            return
        from viewer.background.comparison_job import ComparisonJob

        self._comparison_job = self._comparison_job or ComparisonJob()
        yield from self._comparison_job.results_of(request, inputs)
