"""Inverse image-based rendering: one photo and its disparity become a 4D light field. No window, no GL."""
