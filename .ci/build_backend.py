"""Hatchling, telling pip what a wheel will be without building it: kernels would be compiled once more for that."""

import os

# Where this is set, it leaves that question out, for the sake of build hooks that change what a wheel requires.
os.environ.pop("PIP_BUILD_TRACKER", None)

from hatchling.build import *  # noqa: F403
