"""How far quantities of the window may go that no scene limits."""

DEPTH_STRENGTH_LIMIT = 4.0
SPEED_LIMITS = (0.05, 1.0)
FONT_SCALE_LIMITS = (0.6, 2.5)
LARGEST_SIDE_PX = 65536
"""Largest side of a picture that is asked for in the window, in pixels."""
