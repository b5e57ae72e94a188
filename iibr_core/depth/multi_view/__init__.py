"""Disparity from several views of one scene: a plane sweep, semi-global matching, and refinement by gradients."""
