"""The program's first and last moments, each in a process of its own: signals, streams, folders and names."""

from __future__ import annotations

import ntpath
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.images.photo import read_photo, write_image
from tests.hostile.case import DEADLINE_S, PLAINLY
from tests.hostile.forks import Command
from tests.hostile.surroundings import Begun, Surroundings
from tests.viewer.conftest import write_scene
from viewer import entry

ROOT = Path(__file__).parents[2]
START = (sys.executable, "-P", "-m", "viewer")


def environment(**more: str) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), **more}


def run(*words: object, start: tuple[str, ...] = START, **options: object) -> subprocess.CompletedProcess[bytes]:
    command = [*start, *(word if isinstance(word, bytes) else str(word) for word in words)]
    given = {"env": environment(), "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "timeout": 120, **options}
    return subprocess.run(command, **given)  # type: ignore[call-overload, no-any-return]


def the_error(done: subprocess.CompletedProcess[bytes], code: int = 2) -> str:
    """The only line on stderr."""
    assert done.returncode == code, done.stderr.decode()
    (line,) = done.stderr.decode().splitlines()
    assert line.startswith("iibr: ")
    return line


def in_shell(line: str, **options: object) -> subprocess.CompletedProcess[bytes]:
    """`line` in bash; in it, "iibr" runs the program. Exit code: of the first program of a pipe."""
    script = f'iibr() {{ "{sys.executable}" -P -m viewer "$@"; }}; {line}; exit ${{PIPESTATUS[0]}}'
    return run(start=("bash", "-c", script), **options)


STRIKE = """
import importlib.abc, os, signal, sys
class Strike(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            os.kill(os.getpid(), {number})
sys.meta_path.insert(0, Strike())
from viewer.entry import main
sys.argv = ["iibr", "plan", "nothing.png"]
main()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("name", ["viewer.cli.main", "typer.core", "iibr_core.types", "iibr_core.scenes.loaded_photo"])
def test_interruption_while_modules_are_imported_is_one_line(number: int, name: str) -> None:
    """It strikes when the module is looked for: the first of the program's own, and one that a command needs."""
    done = run(start=(sys.executable, "-P", "-c", STRIKE.format(name=name, number=int(number))))
    assert the_error(done, 130) == "iibr: interrupted"


SWALLOWED = """
import ctypes, os, signal, sys, threading
@ctypes.CFUNCTYPE(None)
def callback():
    os.kill(os.getpid(), signal.SIGINT)
    sum(range(1000))
import viewer.cli.main
def run_command():
    exec("import dataclasses")
    callback()
    threading.Event().wait(60)
viewer.cli.main.main = run_command
from viewer.entry import main
main()
"""


BUSY = """
import threading, time
def start(timer, starts=[], begin=threading.Timer.start):
    begin(timer)
    starts.append(timer)
    time.sleep(0.05 if len(starts) < 3 else 0)
threading.Timer.start = start
"""
"""Before the thread that starts a timer goes on, the timer has ended."""


@pytest.mark.parametrize("before", ["", BUSY], ids=["", "busy"])
def test_an_interruption_in_a_callback_from_c_is_not_lost(before: str) -> None:
    assert the_error(run(start=(sys.executable, "-P", "-c", before + SWALLOWED)), 130) == "iibr: interrupted"


def test_what_is_ignored_stays_ignored() -> None:
    """`nohup iibr ...`"""
    done = in_shell("trap '' HUP; iibr --version & kill -HUP $!; wait $!")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(b"iibr ")


@pytest.mark.parametrize("ignored", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_handlers_are_set_for_all_signals_but_those_that_are_ignored(ignored: str) -> None:
    kinds = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP")]
    before = [signal.getsignal(kind) for kind in kinds]

    def handler(*_: object) -> None:
        pass

    try:
        signal.signal(getattr(signal, ignored), signal.SIG_IGN)
        entry._on_interruption(handler)
        assert [signal.getsignal(kind) for kind in kinds] == [
            signal.SIG_IGN if kind.name == ignored else handler for kind in kinds
        ]
    finally:
        for kind, was in zip(kinds, before):
            signal.signal(kind, was)


@pytest.mark.parametrize("words", ["--version", "--help", "models"])
@pytest.mark.parametrize("where", ["> /dev/full", ">&-", "| head -0"])
def test_a_standard_output_that_takes_nothing_is_one_line(words: str, where: str) -> None:
    assert the_error(in_shell(f"iibr {words} {where}")).startswith("iibr: standard output: ")


@pytest.mark.parametrize("where", ["2> /dev/full", "2>&-"])
def test_notes_that_nobody_can_read_stop_nothing(tmp_path: Path, where: str) -> None:
    write_scene(tmp_path)
    done = in_shell(f"iibr generate scene.png --grid 1 --out field {where}", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.startswith(b"1 views of ")
    assert in_shell(f"iibr plan nothing.png {where}").returncode == 2


def test_nothing_is_written_into_a_file_that_took_the_place_of_a_closed_stream(tmp_path: Path) -> None:
    write_scene(tmp_path)
    done = in_shell("iibr generate scene.png --grid 1 --out field >&- 2>&- <&-", cwd=tmp_path)
    assert done.returncode == 2
    whole = read_photo(tmp_path / "field" / "input_Cam000.png")
    np.testing.assert_array_equal(whole.pixels, read_photo(tmp_path / "scene.png").pixels)


def test_a_working_folder_that_is_gone_is_one_line(tmp_path: Path) -> None:
    done = in_shell(f"mkdir {tmp_path}/gone; cd {tmp_path}/gone; rmdir {tmp_path}/gone; iibr --version")
    assert "working folder is gone" in the_error(done)


@pytest.fixture
def trap(tmp_path: Path) -> Iterator[Path]:
    """A folder of modules that leave a file behind where they are run."""
    for name in ("numpy", "typing", "signal", "typer", "iibr_core", "numba", "enum", "io", "traceback"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'was_run')!r}, 'w').write({name!r})")
    yield tmp_path
    assert not (tmp_path / "was_run").exists(), (tmp_path / "was_run").read_text()


@pytest.mark.parametrize("start", [START, (sys.executable, "-m", "viewer")])
def test_modules_in_the_working_folder_are_not_run(trap: Path, start: tuple[str, ...]) -> None:
    photo = write_scene(trap)
    assert run("plan", photo.name, start=start, cwd=trap).returncode == 0


@pytest.mark.parametrize("home", ["", "somewhere", "/dev/null", "/proc/nothing"])
def test_a_home_that_is_none_leaves_nothing_in_the_working_folder(tmp_path: Path, home: str) -> None:
    write_scene(tmp_path)
    before = sorted(tmp_path.iterdir())
    done = run("plan", "scene.png", cwd=tmp_path, env=environment(HOME=home))
    assert (done.returncode, done.stderr) == (0, b"")
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("failure", ["OSError(5, 'Input/output error', 'a.png')", "EOFError('x')", "TypeError('x')"])
def test_what_nobody_expected_is_one_line_and_tells_more_when_asked(failure: str) -> None:
    code = f"""
import sys
import iibr_core.scenes.loaded_photo
def load_photo(*_): raise {failure}
iibr_core.scenes.loaded_photo.load_photo = load_photo
sys.argv = ["iibr", "plan", "photo.png"]
from viewer.entry import main
main()
"""
    line = the_error(run(start=(sys.executable, "-P", "-c", code)), 2 if "OSError" in failure else 1)
    assert ("a.png: Input/output error" if "OSError" in failure else failure.partition("(")[0]) in line
    more = run(start=(sys.executable, "-P", "-c", code), env=environment(IIBR_TRACEBACK="1")).stderr.decode()
    assert "Traceback" in more
    assert more.splitlines()[-1] == line


ENCODINGS = {
    "UTF-8": {"LC_ALL": "C.UTF-8"},
    "ASCII": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "absent": {"LC_ALL": "en_US.ISO-8859-1", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
}


@pytest.mark.parametrize(
    ("encoding", "name"),
    [("UTF-8", b"\xff"), ("ASCII", "ü€".encode()), ("absent", b"f\xfe/x")],
    ids=["bytes", "text", "folder"],
)
def test_names_of_any_bytes_are_read_written_and_told(tmp_path: Path, encoding: str, name: bytes) -> None:
    folder, env = os.fsencode(tmp_path) + b"/", environment(**ENCODINGS[encoding])
    os.makedirs(os.path.dirname(folder + name), exist_ok=True)
    scene = write_scene(tmp_path)
    scene.rename(os.fsdecode(folder + name + b".png"))
    (tmp_path / "scene_disparity.npy").rename(os.fsdecode(folder + name + b"_d.npy"))
    photo, out = name + b".png", name + b"_o.png"
    disparity = (b"--disparity", name + b"_d.npy")
    shot = ("screenshot", photo, *disparity, "--grid", "1", "-o", out)
    again = ("screenshot", photo, "--like", out, "--grid", "1", "-o", name + b"_p.png")
    field = ("generate", photo, *disparity, "--grid", "1", "--out", name + b"_f")
    with Begun() as begun:  # Python starts but once: it is then that it learns of the encoding
        for number, words in enumerate((shot, again, field)):
            told = tmp_path / f"told{number}"
            told.mkdir()
            command = Command(tuple(map(os.fsdecode, words)), tmp_path, env, told)
            code = begun.run(Surroundings((), tuple(sorted(env.items())), PLAINLY, False), command, DEADLINE_S)
            assert code == 0, (told / "errors").read_bytes()
            assert (told / "output").read_bytes().strip() != b""
    for made in (out, name + b"_p.png", name + b"_f/input_Cam000.png"):
        assert os.path.getsize(folder + made) > 100
    assert "no such file" in the_error(run("plan", name + b"?", cwd=tmp_path, env=env))


def test_panels_ask_for_names_that_they_can_show(tmp_path: Path) -> None:
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/\xff.png"))
    write_image(path, np.zeros((8, 8, 3), np.uint8))
    for words in (("view",), ("screenshot", "--ui", "-o", "o.png")):
        assert "is not UTF-8" in the_error(run(*words, os.fsencode(path), cwd=tmp_path))


@pytest.mark.parametrize("words", [("plan", "nothing.png"), ("--help",), ("models",)])
@pytest.mark.parametrize("threads", ["0", "abc", "-1", "1e3", "1025", "99999999999999999999"])
def test_a_number_of_threads_that_is_none_is_named(threads: str, words: tuple[str, ...]) -> None:
    assert f"NUMBA_NUM_THREADS={threads}" in the_error(run(*words, env=environment(NUMBA_NUM_THREADS=threads)))


def test_what_libraries_warn_of_is_not_told(tmp_path: Path) -> None:
    photo = write_scene(tmp_path)
    done = run("plan", photo, env=environment(NUMBA_DISABLE_JIT="nonsense", NUMBA_NUM_THREADS=""))
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the address space of a program it starts")
@pytest.mark.parametrize("megabytes", [100, 150, 200, 250, 300, 350])
def test_where_not_even_libraries_can_be_loaded_it_says_so(megabytes: int, tmp_path: Path) -> None:
    limited = ("prlimit", f"--as={megabytes * 10**6}")
    told = the_error(run("plan", write_scene(tmp_path), start=(*limited, *START)))
    assert "ulimit -v" in told


AS_NOBODY = (
    *("setpriv", "--reuid=65534", "--clear-groups"),
    *("--inh-caps=+dac_read_search,+dac_override", "--ambient-caps=+dac_read_search,+dac_override"),
)
"""Limits of processes bind everybody but root."""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the processes of a program it starts")
@pytest.mark.parametrize("number", [1, 2])
def test_where_no_thread_may_be_started_it_says_so(number: int, tmp_path: Path) -> None:
    limited = (*(AS_NOBODY if os.geteuid() == 0 else ()), "prlimit", f"--nproc={number}")
    assert "no more threads" in the_error(run("plan", write_scene(tmp_path), start=(*limited, *START)))


HOME_OF_COMMANDS = """
import os
from viewer import entry
entry._run_command = lambda: print(os.environ.get("HOME")) or 0
entry.main()
"""


@pytest.mark.parametrize("home", ["", "somewhere", "/dev/null"])
def test_commands_have_a_home_that_is_a_whole_path_or_none_is_named(tmp_path: Path, home: str) -> None:
    """What libraries keep there would else be kept in the working folder."""
    done = run(start=(sys.executable, "-P", "-c", HOME_OF_COMMANDS), cwd=tmp_path, env=environment(HOME=home))
    assert done.stdout.decode().strip() == (home if os.path.isabs(home) else "None")


def test_who_has_no_home_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a user that the system's database does not know."""
    monkeypatch.setenv("HOME", "nowhere")
    with monkeypatch.context() as unknown:
        unknown.setattr(os.path, "expanduser", lambda path: path)
        entry._ensure_home()
    assert os.environ["HOME"] == os.devnull


def test_a_home_that_windows_does_not_name_is_no_mistake(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.setenv("USERPROFILE", "C:\\Users\\somebody")
    with monkeypatch.context() as windows:
        windows.setattr(os, "path", ntpath)
        entry._ensure_home()
    assert "HOME" not in os.environ
