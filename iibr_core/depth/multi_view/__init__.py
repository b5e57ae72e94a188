"""Disparity from several pictures of one scene: plane sweep, semi-global choice, refinement by gradients."""
