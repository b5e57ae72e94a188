"""Runs `iibr` in forks of one process that has imported it already: each starts in no time. What is refused changes
nothing, so that one fork may run such commands one after the other.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

PRELOADED = (
    "viewer.entry",
    "viewer.cli.main",
    "viewer.app.headless",
    "iibr_core.scenes.loaded_photo",
    "iibr_core.depth.search",
    "iibr_core.generation.light_field",
    "iibr_core.formats.light_fields.hci",
    "iibr_core.evaluation.evaluate_scene",
)
KILLED = 137
CAPABILITIES_VERSION_3 = 0x20080522
OVERRIDING_PERMISSIONS = 1 << 1 | 1 << 2
"""CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH, which root has."""


@dataclass(frozen=True)
class Command:
    """What a fork runs: `iibr` with these arguments in the folder `work`, its standard output and error written into
    the folder `told`. most_bytes: of a file, as on a full disk. is_bound: by permissions, also as root.
    """

    arguments: tuple[str, ...]
    work: Path
    environment: Mapping[str, str]
    told: Path
    most_bytes: int | None = None
    is_bound: bool = False


def run_in_fork(command: Command, deadline_s: float) -> int:
    """Run it in a fork of its own; its exit code."""
    process = _fork(_become_command, command)
    process.join(deadline_s)
    if process.exitcode is None:
        process.kill()
        return KILLED
    # Written by the process itself: threads that start others may have taken the exit code for themselves.
    code = command.told / "code"
    return int(code.read_text()) if code.exists() else process.exitcode


@dataclass
class Turns:
    """One fork that runs commands one after the other; not for several threads. A context manager."""

    _process: Any = None
    _pipe: Connection | None = field(default=None)

    def run(self, command: Command, deadline_s: float) -> int:
        """The exit code of a command; where the fork hangs or dies of it, the next one gets a new fork."""
        if self._pipe is None:
            self._pipe, other = multiprocessing.Pipe()
            self._process = _fork(_take_turns, other)
            other.close()
        try:
            self._pipe.send(command)
            if self._pipe.poll(deadline_s):
                return int(self._pipe.recv())
        except (EOFError, ConnectionError):
            pass
        self._end()
        return KILLED

    def __enter__(self) -> Turns:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _end(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
            self._pipe = self._process = None


def _fork(target: Callable[..., None], *arguments: object) -> Any:
    forks = multiprocessing.get_context("forkserver")
    forks.set_forkserver_preload(list(PRELOADED))
    process = forks.Process(target=target, args=arguments, daemon=True)
    process.start()
    return process


def _become_command(command: Command) -> None:
    if command.is_bound:
        _drop_privileges()
    if command.most_bytes is not None:
        import resource

        sys.dont_write_bytecode = True  # modules that are cut off would be kept
        resource.setrlimit(resource.RLIMIT_FSIZE, (command.most_bytes, command.most_bytes))
    code = _run(command)
    (command.told / "code").write_text(str(code))
    sys.exit(code)


def _take_turns(pipe: Connection) -> None:
    while True:
        try:
            command = pipe.recv()
        except EOFError:
            return
        code = _run(command)
        sys.stdout.flush()
        sys.stderr.flush()
        pipe.send(code)


def _run(command: Command) -> int:
    told = command.told
    for descriptor, name in ((0, os.devnull), (1, told / "output"), (2, told / "errors")):
        opened = os.open(name, os.O_RDONLY if descriptor == 0 else os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(opened, descriptor)
        os.close(opened)
    sys.stdin = os.fdopen(0, closefd=False)
    sys.stdout, sys.stderr = (os.fdopen(descriptor, "w", encoding="utf-8", closefd=False) for descriptor in (1, 2))
    os.environ.clear()
    os.environ.update(command.environment)
    os.chdir(command.work)
    sys.argv = ["iibr", *command.arguments]
    from viewer.entry import main

    try:
        main()
    except SystemExit as ending:
        return int(ending.code or 0)
    return 0


def _drop_privileges() -> None:
    """Permissions bind root as they bind everybody; the one thread that a fork has hands that on to all others."""
    libc = ctypes.CDLL(None, use_errno=True)
    header = (ctypes.c_uint32 * 2)(CAPABILITIES_VERSION_3, 0)
    sets = (ctypes.c_uint32 * 6)()  # effective, permitted and inheritable, of the first 32 and of the rest
    if libc.capget(header, sets) == 0:
        for index in range(3):
            sets[index] &= ~OVERRIDING_PERMISSIONS
        if libc.capset(header, sets) == 0:
            return
    raise OSError(ctypes.get_errno(), "capabilities cannot be dropped")
