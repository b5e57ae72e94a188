"""Published depth models, and the packages that run them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.depth.models.preparation import CONFIG, PLAIN_COLORS, PREPROCESSOR, USUAL_PREPARATION, Preparation
from iibr_core.runtime.extras import install_command, is_installed

Runner = Literal["onnx", "transformers", "unidepth"]
PACKAGES: dict[Runner, tuple[tuple[str, ...], str]] = {
    "onnx": (("onnxruntime",), "use Python 3.11 to 3.14, later ones have no package of it yet"),
    "transformers": (("transformers", "torch"), install_command("depth")),
    "unidepth": (("unidepth", "torch"), "follow github.com/lpiccinelli-eth/UniDepth"),
}
"""Packages of each runner, and how to get them."""
USUAL_MODEL = "depth-anything-v2-small"


@dataclass(frozen=True)
class KnownModel:
    """A published model.

    repository: on the Hugging Face hub; commit: of it, in full, the only one that is downloaded. megabytes: of the
    weights, about. good_for: in a few words. weights: file in the repository, "" for the usual one. has_settings:
    whether JSON files about it lie there, too; else preparation counts. is_metric: whether it gives metres.
    """

    name: str
    title: str
    repository: str
    commit: str
    megabytes: int
    licence: str
    good_for: str
    runner: Runner = "transformers"
    weights: str = ""
    has_settings: bool = True
    preparation: Preparation = USUAL_PREPARATION
    is_metric: bool = False

    @property
    def files(self) -> tuple[str, ...]:
        """Names of its files, the weights last."""
        weights = self.weights or ("onnx/model.onnx" if self.runner == "onnx" else "model.safetensors")
        return (CONFIG, PREPROCESSOR, weights) if self.has_settings else (weights,)

    @property
    def runs_as_installed(self) -> bool:
        """Return whether it runs without optional packages."""
        return self.runner == "onnx"

    @property
    def is_recommended(self) -> bool:
        """Return whether it is the model to begin with."""
        return self.name == USUAL_MODEL

    @property
    def figures(self) -> str:
        """Size, licence and meaning, for lists."""
        return f"{self.megabytes:,} MB, {self.licence}, {'metres' if self.is_metric else 'relative depth'}"

    @property
    def advice(self) -> str:
        """Purpose, and whether it is recommended, for lists."""
        return f"Good for {self.good_for}." + (" Recommended." if self.is_recommended else "")

    @property
    def needs(self) -> str:
        """A sentence about the package that must be installed first, "" if none must."""
        package = missing_package(self.runner)
        return f"Needs the package {package}." if package else ""


def missing_package(runner: Runner) -> str:
    """Return the first package that is not installed and how to get it, "" if all are."""
    packages, advice = PACKAGES[runner]
    return next((f"{package} first: {advice}" for package in packages if not is_installed(package)), "")


KNOWN_MODELS = (
    KnownModel(
        USUAL_MODEL,
        "Depth Anything V2 Small",
        "onnx-community/depth-anything-v2-small",
        "64fe43eba7f8a384b02fe3fadaa26cbba35548d8",
        99,
        "Apache-2.0",
        "any photo",
        "onnx",
    ),
    KnownModel(
        "depth-anything-v2-small-int8",
        "Depth Anything V2 Small, 8 bits",
        "onnx-community/depth-anything-v2-small",
        "64fe43eba7f8a384b02fe3fadaa26cbba35548d8",
        27,
        "Apache-2.0",
        "any photo where the line is slow; coarser numbers",
        "onnx",
        "onnx/model_int8.onnx",
    ),
    KnownModel(
        "moge-2-small",
        "MoGe-2 Small",
        "Ruicheng/moge-2-vits-normal-onnx",
        "e50ffda41565591092adea54c6ac83d6212e1e23",
        141,
        "MIT",
        "distances in metres and the focal length, of any photo; knows the sky",
        "onnx",
        "model.onnx",
        has_settings=False,
        is_metric=True,
    ),
    KnownModel(
        "midas-small",
        "MiDaS 2.1 Small",
        "julienkay/sentis-MiDaS",
        "3186add7635419f19189ce96a7c9b6280b9a1aed",
        66,
        "MIT",
        "slow machines and comparison with older work; 256 pixels",
        "onnx",
        "onnx/midas_v21_small_256.onnx",
        has_settings=False,
        preparation=PLAIN_COLORS,
    ),
    KnownModel(
        "depth-anything-v2-base",
        "Depth Anything V2 Base",
        "onnx-community/depth-anything-v2-base",
        "6db5e16b48d85e78c043e57f8411a23550edbbfc",
        389,
        "CC-BY-NC-4.0 (not for commercial use)",
        "any photo; finer shapes than Small, slower",
        "onnx",
    ),
    KnownModel(
        "depth-anything-v2-large",
        "Depth Anything V2 Large",
        "onnx-community/depth-anything-v2-large",
        "e5476ff1183c8cfb19fcf293a5904c7403e77695",
        1340,
        "CC-BY-NC-4.0 (not for commercial use)",
        "any photo; the finest shapes of the three, the slowest",
        "onnx",
    ),
    KnownModel(
        "depth-anything-v2-metric-indoor",
        "Depth Anything V2 Metric Indoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Indoor-Small-hf",
        "8078d68a9c75a972131914f6afd0c1723be0da7f",
        99,
        "Apache-2.0",
        "rooms, where distances in metres matter",
        is_metric=True,
    ),
    KnownModel(
        "depth-anything-v2-metric-outdoor",
        "Depth Anything V2 Metric Outdoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Outdoor-Small-hf",
        "fd2c22027eaf20374204f14099b8341e1925ad39",
        99,
        "Apache-2.0",
        "streets and landscapes, where distances in metres matter",
        is_metric=True,
    ),
    KnownModel(
        "depth-pro",
        "Depth Pro",
        "apple/DepthPro-hf",
        "de816c8ce7168afcb231f96d501d72b869d0beda",
        1904,
        "Apple's model licence (for research)",
        "sharp outlines such as hair, and distances in metres; slow",
        is_metric=True,
    ),
    KnownModel(
        "zoedepth",
        "ZoeDepth",
        "Intel/zoedepth-nyu-kitti",
        "f364d4c7936e91f465abba182208dd68142bf0ca",
        1380,
        "MIT",
        "distances in metres, indoors and on streets, under a free licence",
        is_metric=True,
    ),
)
"""Sizes and licences as published; the repository has the last word."""
