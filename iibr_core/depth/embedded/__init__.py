"""Depth that a photo file carries itself."""
