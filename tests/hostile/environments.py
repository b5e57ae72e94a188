"""Hostile cases of what a command finds around it: no home, no locale, no room, no output, no working folder, traps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tests.hostile.case import CLOSED_OUTPUT, FULL_OUTPUT, Case, nothing
from tests.hostile.inputs import NOT_UTF8
from tests.hostile.outputs import WRITING

NOT_ASCII = "größe 大.png"
PLAN = ("plan", "photo.png", "--disparity", "map.pfm")
SCREENSHOT = (*WRITING["screenshot"], "new.png")
GENERATE = (*WRITING["generate"], "new")
MODELS = ("models",)
MAKING: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (PLAN, ()),
    (SCREENSHOT, ("new.png",)),
    (GENERATE, ("new",)),
    (MODELS, ()),
)
"""Commands that end well, and what they make."""


def _make_locked_home(folder: Path) -> None:
    (folder / "home").mkdir(mode=0o500)


def _make_file_for_home(folder: Path) -> None:
    (folder / "home").write_text("no folder")


def _set_traps(folder: Path) -> None:
    """Files of the user's that are named as modules are."""
    for name in ("numpy", "typing", "typer", "torch", "json", "viewer", "iibr_core", "sitecustomize", "usercustomize"):
        (folder / f"{name}.py").write_text("raise SystemExit('the trap snaps')")


def _copy_photo(name: str) -> Callable[[Path], None]:
    def prepare(folder: Path) -> None:
        (folder / name).write_bytes((folder / "photo.png").read_bytes())

    return prepare


_HOMES: tuple[tuple[str, dict[str, str | None], Callable[[Path], None]], ...] = (
    ("no home", {"HOME": None}, nothing),
    ("a home that may not be written", {"HOME": "{folder}/home"}, _make_locked_home),
    ("kernels kept nowhere", {"NUMBA_CACHE_DIR": "/proc/none"}, nothing),
    ("an empty home", {"HOME": ""}, nothing),
    ("a home that is not there", {"HOME": "/nonexistent"}, nothing),
    ("a file for a home", {"HOME": "{folder}/home"}, _make_file_for_home),
    ("caches nowhere", {"XDG_CACHE_HOME": "/proc/none", "XDG_CONFIG_HOME": "/proc/none"}, nothing),
    ("models nowhere", {"HF_HOME": "/proc/none"}, nothing),
    ("no temporary folder", {"TMPDIR": "/nonexistent"}, nothing),
)

_homes = [
    Case(f"{command[0]} with {words}", command, 0, "", makes, environment, prepare, is_bound=True)
    for (command, makes), homes in zip(MAKING, (_HOMES, _HOMES[:3], _HOMES[:3], _HOMES))
    for words, environment, prepare in homes
]

_LOCALES: tuple[tuple[str, dict[str, str | None]], ...] = (
    ("the C locale", {"LANG": "C", "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}),
    ("POSIX without coercion", {"LC_ALL": "POSIX", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}),
    ("ASCII output", {"PYTHONIOENCODING": "ascii"}),
    ("Latin output", {"PYTHONIOENCODING": "latin-1"}),
    ("an unknown locale", {"LC_ALL": "xx_YY.NOPE"}),
)

_locales = [
    Case(f"{command} {words} in {place}", arguments, code, "", makes, environment, prepare)
    for number, (place, environment) in enumerate(_LOCALES)
    for command, words, arguments, code, makes, prepare in (
        ("plan", "umlauts", ("plan", NOT_ASCII), 0, (), _copy_photo(NOT_ASCII)),
        ("plan", "missing umlauts", ("plan", "ohne größe.png"), 2, (), nothing),
        ("plan", "a missing name that is not UTF-8", ("plan", NOT_UTF8), 2, (), nothing),
        ("screenshot", "onto umlauts", (*SCREENSHOT[:-1], NOT_ASCII), 0, (NOT_ASCII,), nothing),
        ("generate", "into umlauts", (*GENERATE[:-1], "größe"), 0, ("größe",), nothing),
    )[: 5 if number in (0, 2) else 3]
]

_streams = [
    case
    for command, makes in (*MAKING, (("--help",), ()), (("--version",), ()), (("plan", "--help"), ()))
    for case in (
        Case(f"{' '.join(command[:1])} {command[-1]} onto a full output", command, 2, "", makes, shell=FULL_OUTPUT),
        Case(f"{' '.join(command[:1])} {command[-1]} without an output", command, 2, "", makes, shell=CLOSED_OUTPUT),
    )
] + [
    Case("plan without errors", ("plan", "missing.png"), is_mute=True, shell='exec "$@" 2>&-'),
    Case("plan onto full errors", ("plan", "missing.png"), is_mute=True, shell='exec "$@" 2>/dev/full'),
    Case("screenshot onto full errors", SCREENSHOT, 0, "", ("new.png",), is_mute=True, shell='exec "$@" 2>/dev/full'),
    Case("plan without any input", PLAN, 0, shell='exec "$@" <&-'),
    Case("models get without any input", ("models", "get", "depth-pro"), says="--yes", shell='exec "$@" <&-'),
]

_GONE = 'mkdir gone && cd gone && rmdir ../gone && exec "$@"'

_folders = [
    Case("plan where the folder is gone", ("plan", "photo.png"), shell=_GONE, says="folder"),
    Case("plan a whole path where the folder is gone", ("plan", "{folder}/photo.png"), shell=_GONE, says="folder"),
    Case("screenshot where the folder is gone", SCREENSHOT, shell=_GONE),
    Case("generate where the folder is gone", GENERATE, shell=_GONE),
    Case("evaluate where the folder is gone", ("evaluate", "field", "--out", "new"), shell=_GONE),
    Case("train where the folder is gone", (*WRITING["train"], "new.safetensors"), shell=_GONE),
    Case("view where the folder is gone", ("view", "photo.png"), shell=_GONE),
    Case("demo where the folder is gone", ("demo",), shell=_GONE),
    Case("help where the folder is gone", ("--help",), shell=_GONE, says="folder"),
    *(Case(f"{command[0]} among traps", command, 0, "", makes, prepare=_set_traps) for command, makes in MAKING),
]

_threads = [
    Case(f"{command[0]} with {number!r} threads", command, says=f"NUMBA_NUM_THREADS={number}",
         environment={"NUMBA_NUM_THREADS": number})
    for command, _ in MAKING
    for number in ("0", "abc")
]  # fmt: skip

_limits = [
    Case(f"{command[0]} with {words}", command, 0, "", makes, environment=environment, limits=limits)
    for command, makes in MAKING[:3]
    for words, environment, limits in (
        ("few open files", {}, ("--nofile=64",)),
        ("no core files", {}, ("--core=0",)),
        ("a small stack", {}, ("--stack=1048576",)),
        ("asserts off", {"PYTHONOPTIMIZE": "2"}, ()),
    )
] + [
    Case("screenshot in little memory", SCREENSHOT, limits=("--as=900000000",)),
    Case("screenshot in hardly any memory", SCREENSHOT, limits=("--as=500000000",)),
    Case("view without a display", ("view", "photo.png"), says="iibr screenshot"),
    Case("view with a display that is not there", ("view", "photo.png"), environment={"DISPLAY": ":987"}),
    Case("view with nonsense for a display", ("view", "photo.png"), environment={"DISPLAY": "nonsense"}),
]

PLACE_CASES = (*_homes, *_locales, *_folders)
LIMIT_CASES = (*_streams, *_threads, *_limits)
