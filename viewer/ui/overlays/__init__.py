"""Drawings and windows over the picture."""
