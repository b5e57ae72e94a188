"""One hostile case: a command in a folder of its own, run as a user runs it, and what is left of that folder."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import subprocess
import sysconfig
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from tests.hostile.forks import Command, Turns, run_in_fork
from tests.hostile.surroundings import Begun, Surroundings

IIBR = str(Path(sysconfig.get_path("scripts")) / "iibr")
DEADLINE_S = 120.0
"""Of one command. None takes so long; one that hangs must not hang the tests."""

WITHOUT_PRIVILEGES = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")
"""Before a command: permissions bind root as they bind everybody."""

FULL_DISK = "--fsize="
PLAINLY = 'exec "$@"'
CLOSED_OUTPUT = 'exec "$@" >&-'
FULL_OUTPUT = 'exec "$@" >/dev/full'
FIRST = {"NUMBA_NUM_THREADS", "DISPLAY"}
"""Variables that end a command before or while it imports, or that libraries read but once."""


def nothing(folder: Path) -> None:
    """Leave the folder as it is."""


@dataclass(frozen=True)
class Case:
    """arguments: of `iibr`; "{folder}" stands for the case's folder, where the command runs. code: the exit code
    expected. says: a part of the line on standard error. makes: what may be new afterwards. environment: changes, None
    takes a variable away. prepare: changes the folder before. limits: `prlimit`'s. shell: how the shell starts the
    command, "$@". is_mute: standard error goes elsewhere. is_bound: by permissions, also where the tests run as root.
    """

    name: str
    arguments: tuple[str, ...]
    code: int = 2
    says: str = ""
    makes: tuple[str, ...] = ()
    environment: Mapping[str, str | None] = field(default_factory=dict)
    prepare: Callable[[Path], None] = nothing
    limits: tuple[str, ...] = ()
    shell: str = PLAINLY
    is_mute: bool = False
    is_bound: bool = False

    @property
    def runs_apart(self) -> bool:
        """Whether it needs a process of its own: what surrounds it counts while Python starts."""
        limits = [limit for limit in self.limits if not limit.startswith(FULL_DISK)]
        return bool(self.environment or limits or self.is_mute) or self.shell != PLAINLY

    @property
    def surroundings(self) -> Surroundings | None:
        """What Python starts in, for a process that begins several commands; None where each is to start again: where
        memory is short, the folder is gone, or what `main` does before it imports anything is what counts.
        """
        if not self.runs_apart or self.is_mute or self.shell not in (PLAINLY, CLOSED_OUTPUT, FULL_OUTPUT):
            return None
        if any(limit.startswith(("--as=", "--nofile=16")) for limit in self.limits) or self.environment.keys() & FIRST:
            return None
        wrapper = ("prlimit", *self.limits) if self.limits else ()
        wrapper += WITHOUT_PRIVILEGES if self.is_bound and os.geteuid() == 0 else ()
        return Surroundings(wrapper, tuple(sorted(self.environment.items())), self.shell, self.shell != PLAINLY)

    @property
    def takes_turns(self) -> bool:
        """Whether a process that runs others will do: it is refused, so that nothing of it may stay."""
        return not (self.runs_apart or self.limits or self.is_bound) and self.code != 0

    @property
    def changes_nothing(self) -> bool:
        """Whether the folder is the same before and after, so that others may use it."""
        return self.takes_turns and self.prepare is nothing and not self.makes


@dataclass(frozen=True)
class Ended:
    """How a case ended. changed: what is new, gone or other than before, but for what the case may make."""

    code: int
    output: str
    errors: str
    changed: tuple[str, ...]


def run_case(case: Case, template: Path, folder: Path, turns: Turns | None = None, begun: Begun | None = None) -> Ended:
    """Copy the template to the folder, run the command there, and compare. turns: who runs what may be refused. begun:
    who runs what starts in its surroundings.
    """
    work = _copied(template, folder)
    case.prepare(work)
    before = snapshot(work)
    end = _ended(case, work, folder, turns, before, begun)
    _unlock(folder)
    shutil.rmtree(folder)
    return end


class CaseRunner:
    """Runs cases one after the other, those that change nothing in one folder. A context manager; folder: an empty one.

    template: what each finds in its folder.
    """

    def __init__(self, template: Path, folder: Path) -> None:
        self._template, self._folder = template, folder
        self._turns, self._begun = Turns(), Begun()
        self._shared: tuple[Path, dict[str, str]] | None = None

    def __enter__(self) -> CaseRunner:
        return self

    def __exit__(self, *_: object) -> None:
        self._turns.__exit__()
        self._begun.__exit__()

    def run(self, case: Case) -> Ended:
        """How it ends."""
        if not case.changes_nothing:
            return run_case(case, self._template, Path(tempfile.mkdtemp(dir=self._folder)), self._turns, self._begun)
        if self._shared is None:
            folder = Path(tempfile.mkdtemp(dir=self._folder))
            self._shared = folder, snapshot(_copied(self._template, folder))
        folder, before = self._shared
        end = _ended(case, folder / "work", folder, self._turns, before)
        if end.changed:
            self._shared = None
        return end


def _copied(template: Path, folder: Path) -> Path:
    (folder / "home").mkdir()
    return Path(shutil.copytree(template, folder / "work", symlinks=True))


def _ended(
    case: Case,
    work: Path,
    folder: Path,
    turns: Turns | None,
    before: dict[str, str],
    begun: Begun | None = None,
) -> Ended:
    home = folder / "home"
    environment = {"PATH": os.environ["PATH"], "HOME": str(home), "LANG": "C.UTF-8", **_inherited(), **case.environment}
    arguments = tuple(word.replace("{folder}", str(work)) for word in case.arguments)
    given = {name: value.replace("{folder}", str(work)) for name, value in environment.items() if value is not None}
    surroundings = case.surroundings if begun else None
    if begun and surroundings:
        code = begun.run(surroundings, Command(arguments, work, given, folder), DEADLINE_S)
    elif case.runs_apart:
        code = _run_apart(case, arguments, work, given, folder)
    else:
        sizes = [int(limit.removeprefix(FULL_DISK)) for limit in case.limits]
        is_bound = case.is_bound and os.geteuid() == 0
        command = Command(arguments, work, given, folder, min(sizes, default=None), is_bound)
        code = turns.run(command, DEADLINE_S) if turns and case.takes_turns else run_in_fork(command, DEADLINE_S)
    output, errors = ((folder / name).read_bytes().decode("utf-8", "backslashreplace") for name in ("output", "errors"))
    changed = tuple(name for name in _differences(before, snapshot(work)) if not _is_made(name, case.makes))
    return Ended(code, output, errors, changed)


def by_name(cases: tuple[Case, ...]) -> list[Any]:
    """Parameters of a test, those that start in the same surroundings one after the other."""
    places = list(dict.fromkeys(case.surroundings for case in cases))
    return [pytest.param(case, id=case.name) for case in sorted(cases, key=lambda c: places.index(c.surroundings))]


def require_good_end(case: Case, end: Ended) -> None:
    """As expected: one line where it fails, nothing changed but what may be."""
    told = f"{' '.join(case.arguments)}\nexit {end.code}\n{end.errors}{end.output}"
    assert "Traceback" not in end.errors + end.output, told
    assert end.code == case.code, told
    assert end.changed == (), told
    if case.code != 0 and not case.is_mute:
        lines = end.errors.splitlines()
        assert len(lines) == 1, told
        assert lines[0].startswith("iibr: "), told
        assert case.says in lines[0], told


def snapshot(folder: Path) -> dict[str, str]:
    """What a folder holds: of each path the kind and permissions, of files the contents, of links the target."""
    found = {}
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = Path(place, name)
            status = path.lstat()
            content = stat.filemode(status.st_mode)
            if stat.S_ISLNK(status.st_mode):
                content += str(path.readlink())
            elif stat.S_ISREG(status.st_mode):
                content += hashlib.sha256(path.read_bytes()).hexdigest()
            found[str(path.relative_to(folder))] = content
    return found


def _run_apart(case: Case, arguments: tuple[str, ...], work: Path, environment: dict[str, str], told: Path) -> int:
    """As `run_in_fork`, in a process of its own, as a user starts it."""
    with (told / "output").open("wb") as output, (told / "errors").open("wb") as errors:
        words = [*_wrapper(case), IIBR, *arguments]
        done = subprocess.run(
            words,
            cwd=work,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=errors,
            timeout=DEADLINE_S,
            check=False,
        )
    return done.returncode


def _wrapper(case: Case) -> tuple[str, ...]:
    words: tuple[str, ...] = ("prlimit", *case.limits) if case.limits else ()
    if case.is_bound and os.geteuid() == 0:
        words += WITHOUT_PRIVILEGES
    return (*words, "sh", "-c", case.shell, "sh") if case.shell != PLAINLY else words


def _inherited() -> dict[str, str]:
    return {name: os.environ[name] for name in ("PYTHONPATH",) if name in os.environ}


def _differences(before: dict[str, str], after: dict[str, str]) -> list[str]:
    return [name for name in sorted({*before, *after}) if before.get(name) != after.get(name)]


def _is_made(name: str, makes: tuple[str, ...]) -> bool:
    return any(name == made or name.startswith(f"{made}/") for made in makes)


def _unlock(folder: Path) -> None:
    """What the case locked may go all the same, where the tests do not run as root."""
    for place, folders, _ in os.walk(folder):
        for name in folders:
            path = Path(place, name)
            if not path.is_symlink():
                path.chmod(0o700)
