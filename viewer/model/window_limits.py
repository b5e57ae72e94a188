"""Limits of quantities of the window that do not depend on the scene."""

DEPTH_STRENGTH_LIMIT = 4.0
"""Largest depth strength."""
SPEED_LIMITS = (0.05, 1.0)
"""Slowest and fastest loop, in turns per second."""
FONT_SCALE_LIMITS = (0.6, 2.5)
"""Smallest and largest scale of text."""
LARGEST_SIDE_PX = 65536
"""Largest side of a picture that is asked for in the window, in pixels."""
