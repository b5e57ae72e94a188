"""Measurements, not tests. README.md lists the programs; the text of each begins with its command."""
