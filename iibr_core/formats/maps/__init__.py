"""Disparity and depth files, in and out."""
