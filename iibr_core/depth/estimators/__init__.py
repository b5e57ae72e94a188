"""Trained depth models: which there are, where they lie, how they run."""
