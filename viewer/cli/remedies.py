"""Remedies of errors in the words of the command line, which are its options."""

from __future__ import annotations

from iibr_core.remedies import Remedy, remedy_of

BETTER_DEPTH = (
    "Better: give a depth map with --disparity FILE, or a trained model with --depth-model (`iibr models` lists what is"
    " there)."
)
WORDS = {
    Remedy.REPLACE: "give --force to replace it, or choose another name",
    Remedy.SMALLER: "lower --grid or --max-pixels",
    Remedy.DEPTH: "get it with `iibr models get NAME`, or give a depth map with --disparity FILE",
    Remedy.DOWNLOAD: "check the network and try again, name a mirror in HF_ENDPOINT, or use an ONNX file of your own",
    Remedy.STRETCH: "or add --stretch if it shows the whole photo",
}


def words_of(error: Exception) -> str:
    """Return the message of an error, with its remedy."""
    remedy = remedy_of(error)
    return str(error) if remedy is None else f"{error}; {WORDS[remedy]}"
