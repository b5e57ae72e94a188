"""What a family of depth estimators is, and its models: published ones, and those on this machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.runtime.extras import is_installed
from iibr_core.types import ImageSize, Photo


@dataclass(frozen=True)
class KnownModel:
    """A published model. repository: on the Hugging Face hub; commit: of it, in full: no other is downloaded.
    megabytes: of its weights, about. good_for: in a few words. is_recommended: one model is.
    """

    name: str
    title: str
    repository: str
    commit: str
    megabytes: int
    licence: str
    good_for: str
    is_recommended: bool = False


@dataclass(frozen=True)
class LocalModel:
    """A model on this machine. weights: the files that hold them, in order of their names."""

    title: str
    folder: Path
    family: Family
    weights: tuple[Path, ...]

    @property
    def weight_bytes(self) -> int:
        """What they take on disk."""
        return sum(path.stat().st_size for path in self.weights)


Run = Callable[[Photo], DepthEstimate]


@dataclass(frozen=True)
class Family:
    """Depth models that run and are read in the same way; each family has a file of its own.

    packages: that run them, as Python imports them; install: how to get those. fetched: patterns of the files that are
    downloaded. models: the published ones.

    accepts: whether a user's folder holds a model of this family; raises InputError where its config.json is damaged.
    weights_in: the files of the weights in a folder; raises InputError where there are none that may be read.
    prepare: for a model, a photo's (height, width) and the memory in bytes, everything else that the estimate depends
    on, and what makes it; raises InputError. That is given a photo in sRGB; NaN is unknown where leaves_gaps is true.
    """

    packages: tuple[str, ...]
    install: str
    fetched: tuple[str, ...]
    accepts: Callable[[Path], bool]
    weights_in: Callable[[Path], tuple[Path, ...]]
    prepare: Callable[[LocalModel, ImageSize, int], tuple[object, Run]]
    models: tuple[KnownModel, ...] = ()
    leaves_gaps: bool = False

    def lacking_package(self) -> str | None:
        """The first of the packages that is not installed, None where all are."""
        return next((package for package in self.packages if not is_installed(package)), None)
