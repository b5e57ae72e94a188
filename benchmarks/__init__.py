"""Figures, not tests: `make bench` writes those that the README quotes; every module says how it is called."""
