"""Figures, not tests: `make bench` writes those in docs/speed.md; every module says how it is called."""
