"""Whole archives: every photo of some folders, exported by worker processes on this machine or others."""
