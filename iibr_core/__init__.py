"""Inverse image-based rendering: one photo and its disparity become a 4D light field. No window, no GL.

The public Python interface; docs/python.md shows it by examples. `import iibr_core as iibr` loads nothing but names.
Pictures are (H, W, 3), encoded by sRGB's curve: float32 with 1 = white, or uint8. Disparity is (H, W) float32, larger
is closer. Light fields are (V, U, H, W, ...), v down, u right; their disparity is in px from view to view.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "interface.fields": ["FORMATS", "LightField", "View"],
        "interface.judging": ["Comparison", "compare", "evaluate"],
        "interface.public_scene": ["Scene", "estimate_depth", "from_arrays", "open"],
        "runtime.work": ["Cancelled"],
        "stages": ["Stages"],
        "types": ["InputError"],
    },
)
