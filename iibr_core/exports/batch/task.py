"""What a worker is told about one photo, what it answers, and the key that says whether the answer is known already."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

from iibr_core.depth.sidecar import map_to_read
from iibr_core.exports.batch.archive import ArchivePhoto
from iibr_core.exports.kinds import EXPORTS, ExportKind
from iibr_core.exports.options import USUAL_OPTIONS, ExportOptions
from iibr_core.formats.files import open_binary
from iibr_core.rendering.gloss.gloss_settings import Gloss
from iibr_core.scenes.scene import Source

CLAIM_PREFIX = ".iibr-batch-"
MOST_READ_BYTES = 1 << 20
"""At a time."""


@dataclass(frozen=True)
class BatchSettings:
    """How every photo is exported. kind: by name. source: for any photo, its path empty. focus, aperture, gloss: as
    `Optics` has them, None for what the window shows.
    """

    kind: str
    source: Source
    depth_strength: float = 1.0
    options: ExportOptions = USUAL_OPTIONS
    focus: float | None = None
    aperture: float | None = None
    gloss: Gloss | None = None

    @property
    def export_kind(self) -> ExportKind:
        """What is written."""
        return EXPORTS[self.kind]

    @cached_property
    def digest(self) -> str:
        """Of all that says what is made of a photo, what is reflected in it included; not of the memory it may take.

        Raises InputError where that cannot be read.
        """
        reflected = self.gloss.environment if self.gloss is not None else ""
        content = _digest_of(Path(reflected)) if reflected else b""
        source = replace(self.source, depth=replace(self.source.depth, memory_bytes=None))
        return hashlib.sha256(repr(replace(self, source=source)).encode() + content).hexdigest()


@dataclass(frozen=True)
class Place:
    """Where an export goes. folder: of all exports. name: in it, before its kind adds to it. own_output: what a batch
    wrote there before, in the folder, "" for nothing. may_replace: whatever is there.
    """

    folder: str
    name: str
    own_output: str = ""
    may_replace: bool = False

    @property
    def target(self) -> Path:
        """The file or folder to write, before its kind adds to the name."""
        return Path(self.folder, self.name)

    @property
    def claim(self) -> Path:
        """A file that says which output is being written, until the manifest does: a batch that was killed in between
        replaces it afterwards.
        """
        return Path(self.folder, f"{CLAIM_PREFIX}{hashlib.sha256(os.fsencode(self.name)).hexdigest()[:32]}")

    def may_write(self, output: Path) -> bool:
        """Whether an output may be replaced."""
        return self.may_replace or (bool(self.own_output) and output == Path(self.folder, self.own_output))


@dataclass(frozen=True)
class PhotoTask:
    """One photo, in a form that goes to other machines. memory_bytes: a worker's share where the settings name none.
    key: of `key_of`.
    """

    photo: str
    place: Place
    key: str
    settings: BatchSettings
    memory_bytes: int | None = None

    def line(self, output: str, **more: Any) -> bytes:
        """Of the manifest, about this output."""
        inner = os.path.relpath(output, self.place.folder)
        about = {"name": self.place.name, "output": inner, "kind": self.settings.kind, "settings": self.settings.digest}
        return json.dumps({**about, **more}).encode() + b"\n"

    @property
    def source(self) -> Source:
        """What is opened."""
        source = self.settings.source
        if source.depth.memory_bytes is None:
            source = replace(source, depth=replace(source.depth, memory_bytes=self.memory_bytes))
        return replace(source, path=self.photo)


@dataclass(frozen=True)
class Outcome:
    """output: what was written, or reason: why it could not be. seconds: that it took. is_guess: its
    depth was guessed.
    """

    output: str = ""
    reason: str = ""
    seconds: float = 0.0
    is_guess: bool = False


def target_name(settings: BatchSettings, photo: ArchivePhoto) -> str:
    """Where a photo's export goes within the folder of all, before its kind adds to the name."""
    return photo.name + (settings.export_kind.endings or ("",))[0]


def key_of(settings: BatchSettings, photo: ArchivePhoto) -> str:
    """The same as long as the export would be: of the photo's and its map's content, the settings, the version, and
    the name that is written.

    Raises InputError where the photo or its map cannot be read.
    """
    digest = hashlib.sha256(f"{version('iibr')} {settings!r} {settings.digest}".encode())
    digest.update(os.fsencode(photo.name) + b"\0")
    path = Path(photo.path)
    map_path = map_to_read(path, settings.source.depth)
    for read in (path, *(() if map_path is None else (map_path,))):
        # A map counts by what its name says of it, too.
        digest.update(os.fsencode(read.name) + b"\0" + _digest_of(read))
    return digest.hexdigest()


def _digest_of(path: Path) -> bytes:
    digest = hashlib.sha256()
    with open_binary(path) as file:
        while part := file.read(MOST_READ_BYTES):
            digest.update(part)
    return digest.digest()
