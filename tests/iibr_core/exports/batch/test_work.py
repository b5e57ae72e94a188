"""What a worker writes of one photo, as the settings say."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.exports.batch.task import BatchSettings, PhotoTask, Place
from iibr_core.exports.batch.work import _claim, export_photo
from iibr_core.rendering.gloss.gloss_settings import Gloss, GlossLight
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape
from viewer.display.scene_drawer import open_drawn

GLOSS = Gloss(roughness=0.5, reflectance=0.5, light=GlossLight((0.0, 0.0, -1.0)))


@pytest.mark.parametrize(("kind", "target"), [("hci", "made"), ("anaglyph", "made.png")])
def test_gloss_is_in_what_is_made_of_views_and_in_what_is_drawn(
    photo_path: Path, tmp_path: Path, kind: str, target: str
) -> None:
    pictures = []
    for gloss in (None, GLOSS):
        settings = replace(BatchSettings(kind, Source("", grid=GridShape(3, 3))), gloss=gloss)
        out = tmp_path / str(gloss is None) / target
        said = export_photo(PhotoTask(str(photo_path), Place(str(out.parent), out.name), "", settings), open_drawn)
        assert not said.reason
        made = Path(said.output)
        files = sorted(made.glob("input_Cam*.png")) if made.is_dir() else [made]
        pictures.append(np.stack([np.asarray(Image.open(path)) for path in files]).astype(int))
    plain, shiny = pictures
    assert (shiny - plain).min() >= -2
    assert (shiny - plain).mean() > 5


def test_a_claim_is_on_disk_to_stay_before_the_photo_counts_as_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its text, and its name in the folder: a power cut cannot be had here, so what is synchronised is noted."""
    synchronised: list[str] = []

    def note(descriptor: int) -> None:
        synchronised.append(os.path.realpath(f"/proc/self/fd/{descriptor}"))

    monkeypatch.setattr(os, "fsync", note)
    task = PhotoTask("a.png", Place(str(tmp_path), "a"), "key", BatchSettings("depth", Source("")))
    _claim(task, tmp_path / "a")
    assert task.place.claim.is_file()
    text, folder = synchronised
    assert Path(text).parent == tmp_path
    assert folder == str(tmp_path)
