"""When a ray is ambiguous, and what asking the transformer costs, in numbers.

The renderer goes by them, and so does the plan's cost model, which must not wait for the renderer to load.
"""

from __future__ import annotations

SOFT = 0.5
"""Where depth edges are softer than this, surfaces are looked for farther around a ray."""
AMBIGUOUS_PX = 1.5
"""A step of disparity that moves its sides apart by less than this makes no ray ambiguous."""
AMBIGUOUS_AROUND_PX = 1.5
"""Soft edges have no steps: there a surface landing near by makes a ray ambiguous if its parallax differs by this."""
EVERY_COST = 8
"""How many times as long a band takes where the transformer is asked for every ray."""
