"""Procedural scenes whose every ray is known."""
