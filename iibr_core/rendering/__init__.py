"""One view from the ray set."""
