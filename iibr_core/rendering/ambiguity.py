"""When a ray is ambiguous, and what asking the transformer costs, in numbers.

The renderer goes by them, and so does the plan's cost model, which must not wait for the renderer to load.
"""

from __future__ import annotations

SOFT = 0.5
"""Where depth edges are softer than this, surfaces are looked for farther around a ray."""
AMBIGUOUS_PX = 1.5
"""Where a step of disparity moves its sides apart by more than this, surfaces meet: some rays there are ambiguous."""
AMBIGUOUS_AROUND_PX = 1.5
"""Near a soft edge a surface that lands near by makes a ray ambiguous if its parallax differs by this."""
