"""Measurements, not tests. `make bench` writes docs/speed.md; the text of every module begins with its command."""
