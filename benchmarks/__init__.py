"""Figures, not tests: `python -m benchmarks.report` prints all of them."""
