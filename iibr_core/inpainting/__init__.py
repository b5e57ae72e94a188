"""Content for what the photo never saw."""
