"""Comparison of generated views with the true views of light fields and stereo scenes."""
