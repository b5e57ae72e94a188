"""Limits, environment and streams that Python starts in, and one process for all commands that start in the same."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from tests.hostile.forks import KILLED, PRELOADED, Command

BEGUN = str(Path(__file__).with_name("begun.py"))


@dataclass(frozen=True)
class Surroundings:
    """wrapper: words before Python. environment: changes. shell: how the shell starts it, "$@"; has_output: whether it
    says where standard output goes.
    """

    wrapper: tuple[str, ...]
    environment: tuple[tuple[str, str | None], ...]
    shell: str
    has_output: bool


class Begun:
    """One process at a time, which has begun in some surroundings and forks for each command. A context manager."""

    def __init__(self) -> None:
        self._surroundings: Surroundings | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._asks, self._told = -1, -1

    def __enter__(self) -> Begun:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def run(self, surroundings: Surroundings, command: Command, deadline_s: float) -> int:
        """The exit code of a command; where it hangs, the next one gets a new process."""
        if surroundings != self._surroundings:
            self._end()
            self._begin(surroundings, command)
        words = (command.work, command.told, *command.arguments)
        pairs = {name: os.fsencode(value).hex() for name, value in command.environment.items()}
        os.write(self._asks, f"{json.dumps([[os.fsencode(word).hex() for word in words], pairs])}\n".encode())
        (command.told / "output").touch()
        is_told, _, _ = select.select([self._told], [], [], deadline_s)
        answer = os.read(self._told, 100) if is_told else b""
        if not answer:
            self._end()
            return KILLED
        return int(answer)

    def _begin(self, surroundings: Surroundings, command: Command) -> None:
        asked, self._asks = os.pipe()
        self._told, told = os.pipe()
        python = [sys.executable, "-P", BEGUN, str(asked), str(told), str(surroundings.has_output), *PRELOADED]
        self._process = subprocess.Popen(
            ["sh", "-c", surroundings.shell, "sh", *surroundings.wrapper, *python],
            cwd=command.told,
            env=dict(command.environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=(asked, told),
            start_new_session=True,
        )
        os.close(asked)
        os.close(told)
        self._surroundings = surroundings

    def _end(self) -> None:
        if self._process is not None:
            os.close(self._asks)
            os.close(self._told)
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        self._process = self._surroundings = None
