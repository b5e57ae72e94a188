"""Pictures through a lens, from stored views."""
