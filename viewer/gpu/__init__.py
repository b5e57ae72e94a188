"""Contexts, programs, textures and the renderer. Only this package imports moderngl."""
