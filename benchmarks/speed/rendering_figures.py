"""What the renderer's switches cost and bring: figures of one picture drawn in many ways."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.speed.measure import Cost, on_the_front


@dataclass(frozen=True)
class MeasuredDrawing:
    """One way to draw a picture. ratio: of time to the reference's; samples: points of the lens that it is made of."""

    name: str
    cost: Cost
    ratio: float
    samples: int
    psnr_db: float
    flip: float


@dataclass(frozen=True)
class DrawingFigures:
    """what: the picture, in words. drawn: the first is the reference."""

    what: str
    drawn: tuple[MeasuredDrawing, ...]

    @property
    def front(self) -> set[str]:
        """Ways that none beats in time and PSNR both."""
        return on_the_front({drawn.name: (drawn.ratio, drawn.psnr_db) for drawn in self.drawn})
