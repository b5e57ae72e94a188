"""Published depth models, and the packages that run them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.depth.models.preparation import CONFIG, PREPROCESSOR
from iibr_core.runtime.extras import is_installed

Runner = Literal["onnx", "transformers", "unidepth"]
PACKAGES: dict[Runner, tuple[str, ...]] = {
    "onnx": ("onnxruntime",),
    "transformers": ("transformers", "torch"),
    "unidepth": ("unidepth", "torch"),
}
INSTALLING: dict[Runner, str] = {
    "onnx": "use Python 3.11 to 3.14, later ones have no package of it yet",
    "transformers": "pip install 'iibr[depth]'",
    "unidepth": "follow github.com/lpiccinelli-eth/UniDepth",
}
ONNX_FILES = (CONFIG, PREPROCESSOR, "onnx/model.onnx")
TORCH_FILES = (CONFIG, PREPROCESSOR, "model.safetensors")


@dataclass(frozen=True)
class KnownModel:
    """A published model.

    repository: on the Hugging Face hub; commit: of it, in full, the only one that is downloaded. megabytes: of the
    weights, about. good_for: in a few words. is_recommended: true for one model.
    """

    name: str
    title: str
    repository: str
    commit: str
    files: tuple[str, ...]
    megabytes: int
    licence: str
    good_for: str
    is_recommended: bool = False

    @property
    def runner(self) -> Runner:
        """Package that runs it."""
        return "onnx" if self.files == ONNX_FILES else "transformers"

    @property
    def figures(self) -> str:
        """Size and licence, for lists."""
        return f"{self.megabytes:,} MB, {self.licence}"

    @property
    def advice(self) -> str:
        """Purpose, and whether it is recommended, for lists."""
        return f"Good for {self.good_for}." + (" Recommended." if self.is_recommended else "")

    @property
    def needs(self) -> str:
        """A sentence about the package that must be installed first, "" if none must."""
        package = missing_package(self.runner)
        return f"Needs the package {package}." if package else ""


KNOWN_MODELS = (
    KnownModel(
        "depth-anything-v2-small",
        "Depth Anything V2 Small",
        "onnx-community/depth-anything-v2-small",
        "64fe43eba7f8a384b02fe3fadaa26cbba35548d8",
        ONNX_FILES,
        99,
        "Apache-2.0",
        "any photo; the fastest",
        is_recommended=True,
    ),
    KnownModel(
        "depth-anything-v2-base",
        "Depth Anything V2 Base",
        "onnx-community/depth-anything-v2-base",
        "6db5e16b48d85e78c043e57f8411a23550edbbfc",
        ONNX_FILES,
        389,
        "CC-BY-NC-4.0 (not for commercial use)",
        "any photo; finer shapes than Small, slower",
    ),
    KnownModel(
        "depth-anything-v2-large",
        "Depth Anything V2 Large",
        "onnx-community/depth-anything-v2-large",
        "e5476ff1183c8cfb19fcf293a5904c7403e77695",
        ONNX_FILES,
        1340,
        "CC-BY-NC-4.0 (not for commercial use)",
        "any photo; the finest shapes of the three, the slowest",
    ),
    KnownModel(
        "depth-anything-v2-metric-indoor",
        "Depth Anything V2 Metric Indoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Indoor-Small-hf",
        "8078d68a9c75a972131914f6afd0c1723be0da7f",
        TORCH_FILES,
        99,
        "Apache-2.0",
        "rooms, where distances in metres matter",
    ),
    KnownModel(
        "depth-anything-v2-metric-outdoor",
        "Depth Anything V2 Metric Outdoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Outdoor-Small-hf",
        "fd2c22027eaf20374204f14099b8341e1925ad39",
        TORCH_FILES,
        99,
        "Apache-2.0",
        "streets and landscapes, where distances in metres matter",
    ),
    KnownModel(
        "depth-pro",
        "Depth Pro",
        "apple/DepthPro-hf",
        "de816c8ce7168afcb231f96d501d72b869d0beda",
        TORCH_FILES,
        1904,
        "Apple's model licence (for research)",
        "sharp outlines such as hair, and distances in metres; slow",
    ),
    KnownModel(
        "zoedepth",
        "ZoeDepth",
        "Intel/zoedepth-nyu-kitti",
        "f364d4c7936e91f465abba182208dd68142bf0ca",
        TORCH_FILES,
        1380,
        "MIT",
        "distances in metres, indoors and on streets, under a free licence",
    ),
    KnownModel(
        "midas-dpt-large",
        "MiDaS 3 (DPT large)",
        "Intel/dpt-large",
        "bc15f29aa3a80d532f2ed650b5e16ac48d8958f9",
        TORCH_FILES,
        1370,
        "Apache-2.0",
        "comparing with older work",
    ),
)
"""Sizes and licences as published; the repository has the last word."""
USUAL_MODEL = next(model.name for model in KNOWN_MODELS if model.is_recommended)


def missing_package(runner: Runner) -> str:
    """Return the first package that is not installed and how to get it, "" if all are."""
    missing = [package for package in PACKAGES[runner] if not is_installed(package)]
    return f"{missing[0]} first: {INSTALLING[runner]}" if missing else ""
