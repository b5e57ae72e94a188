"""Files of a repository on the Hugging Face hub: one commit, compared with what the hub states for it before use.

A folder is used only with its list of verified files beside them: what is half there or was never compared has none.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from iibr_core.formats.files import is_file, printable, read_text, reason_of, stays_within
from iibr_core.formats.outputs import atomic_write
from iibr_core.runtime.tiling import Cancelled, ShouldStop, never
from iibr_core.types import InputError, ReportProgress

VERIFIED = "iibr-verified.json"
"""Beside downloaded files: the digest of each, by its name, as the hub states them."""
DIGEST = re.compile("sha256:[0-9a-f]{64}|blob:[0-9a-f]{40}")
"""Of large files SHA-256; of small ones what git calls a blob: SHA-1 with the length before it."""
MOST_LIST_BYTES = 1 << 20

Digests = Mapping[str, str]


def verified_folder(repository: str, commit: str) -> Path | None:
    """Where a commit's files lie in the hub's cache, None where they were not downloaded and verified."""
    from huggingface_hub import constants  # the rest of that library takes half a second to import

    cache = Path(constants.HF_HUB_CACHE) / f"models--{repository.replace('/', '--')}"
    folder = cache / "snapshots" / commit
    try:
        return folder if is_file(folder / VERIFIED) else None
    except InputError:  # where it may not be looked at
        return None


def download(
    repository: str,
    commit: str,
    patterns: Sequence[str],
    report_progress: ReportProgress | None = None,
    should_stop: ShouldStop = never,
) -> Path:
    """Bring those files of a commit that match a pattern into the hub's cache; returns their folder.

    report_progress: told bytes that are here and bytes in all; None shows bars on stderr. Raises InputError where it
    fails or a file is not what the hub states: that file is removed; Cancelled once should_stop is true. The next call
    goes on from there.
    """
    from huggingface_hub.errors import GatedRepoError

    try:
        stated = _stated_digests(repository, commit, patterns)
        folder = _fetch(repository, commit, sorted(stated), report_progress, should_stop)
    except (Cancelled, InputError):
        raise
    except GatedRepoError as error:
        raise InputError(f"{repository}: its owner asks you to accept a licence on huggingface.co first") from error
    except Exception as error:  # whatever the library's ways to the network raise: they change with its versions
        reason = reason_of(error).removeprefix("Got: ")[:120]
        raise InputError(
            f"{repository} cannot be downloaded ({reason}); check the network, or copy its folder here and name it with"
            " --depth-model"
        ) from error
    for name in _unlike(folder, stated):
        _remove(folder / name)
        raise InputError(
            f"{repository}: {name} is not what the hub states for commit {commit[:7]}; it was removed, get it again"
        )
    with atomic_write(folder / VERIFIED) as temporary:
        temporary.write_text(json.dumps(stated, indent=1) + "\n", "utf-8")
    return folder


def require_unchanged(folder: Path) -> None:
    """Raise InputError where a downloaded file is not what was verified. Folders from elsewhere have no list."""
    path = folder / VERIFIED
    if not is_file(path):
        return
    try:
        stated = json.loads(read_text(path, MOST_LIST_BYTES))
        if not isinstance(stated, dict) or not all(map(_is_digest, stated.values())):
            raise ValueError("no digests")
        changed = _unlike(folder, stated)
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged ({reason_of(error)}); delete {folder} and get it again") from error
    if changed:
        raise InputError(f"{folder}: {changed[0]} changed since it was downloaded; delete {folder} and get it again")


def _stated_digests(repository: str, commit: str, patterns: Sequence[str]) -> dict[str, str]:
    """What the hub states for the files that are wanted, by name. Raises InputError where it states none."""
    from huggingface_hub import model_info

    about = model_info(repository, revision=commit, files_metadata=True)
    if about.sha != commit:
        raise InputError(f"{repository}: the hub answers with commit {about.sha}, not {commit}; get it elsewhere")
    stated = {}
    for file in about.siblings or ():
        if any(fnmatch(file.rfilename, pattern) for pattern in patterns):
            stated[file.rfilename] = f"sha256:{file.lfs.sha256}" if file.lfs else f"blob:{file.blob_id}"
    lacking = [name for name, digest in stated.items() if not _is_digest(digest) or not stays_within(name)]
    if lacking or not stated:
        what = f"no hash of {printable(lacking[0])}" if lacking else f"no files like {', '.join(patterns)}"
        raise InputError(f"{repository}: the hub states {what} for commit {commit[:7]}; get it elsewhere")
    return stated


def _fetch(
    repository: str,
    commit: str,
    names: list[str],
    report_progress: ReportProgress | None,
    should_stop: ShouldStop,
) -> Path:
    from huggingface_hub import snapshot_download

    bars = None if report_progress is None else _counting_bars(report_progress, should_stop)
    return Path(snapshot_download(repository, revision=commit, allow_patterns=names, tqdm_class=bars))


def _unlike(folder: Path, stated: Digests) -> list[str]:
    """Names of the files that are not what is stated."""
    return [name for name, digest in sorted(stated.items()) if _digest_of(folder / name, digest) != digest]


def _digest_of(path: Path, like: str) -> str:
    """Of a file, of the same kind as another digest; "" where it is not there."""
    if not is_file(path):
        return ""
    kind, _, _ = like.partition(":")
    digest = hashlib.sha256() if kind == "sha256" else hashlib.sha1(b"blob %d\0" % path.stat().st_size)
    with path.open("rb") as file:
        return f"{kind}:{hashlib.file_digest(file, lambda: digest).hexdigest()}"


def _is_digest(text: object) -> bool:
    return isinstance(text, str) and DIGEST.fullmatch(text) is not None


def _remove(path: Path) -> None:
    """The file, and the one in the hub's cache that it is a link to."""
    path.resolve().unlink(missing_ok=True)
    path.unlink(missing_ok=True)


def _counting_bars(report_progress: ReportProgress, should_stop: ShouldStop) -> type[Any]:
    """Progress bars for the hub library that show nothing: they count, and stop the download."""
    from tqdm import tqdm  # type: ignore[import-untyped]

    class CountingBar(tqdm):  # type: ignore[misc]
        def __init__(self, *args: Any, **options: Any) -> None:
            self._counts_bytes = options.get("unit") == "B"
            super().__init__(*args, **{**options, "disable": True})

        def update(self, n: float | None = 1) -> None:
            if should_stop():
                raise Cancelled
            self.n += n or 0
            if self._counts_bytes:
                report_progress(self.n, self.total or 0, "downloading")

    return CountingBar
