"""Simulated specularity: a surface of the photo made glossy under a given light (the paper's section of that name)."""
