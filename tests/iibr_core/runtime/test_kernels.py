import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import iibr_core
from iibr_core.runtime.compiling import COMPILING

ENCODING = """
from iibr_core.encoding_constants import GAIN
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import srgb_scalar


@kernel
def encode(linear):
    return _encode(linear) * GAIN


@kernel
def _encode(linear):
    return srgb_scalar(linear)
"""
CALL = """
from iibr_core.runtime.compiling import watch_compiling
messages = []
with watch_compiling(messages.append):
    from iibr_core.encoding import encode
    print(encode(0.001), *messages, sep="|")
"""
# Root may write everywhere, unless it gives that up.
UNPRIVILEGED = ("setpriv", "--bounding-set=-all", "--inh-caps=-all") if os.geteuid() == 0 else ()


@pytest.fixture
def package(tmp_path) -> Path:
    """A copy of the package with what kernels need, and one kernel that uses things of other files."""
    source, copy = Path(iibr_core.__file__).parent, tmp_path / "iibr_core"
    for name in ("__init__", "runtime/__init__", "runtime/compiling", "runtime/kernels", "runtime/scalars"):
        (copy / f"{name}.py").parent.mkdir(exist_ok=True, parents=True)
        shutil.copy(source / f"{name}.py", copy / f"{name}.py")
    (copy / "encoding.py").write_text(ENCODING)
    (copy / "encoding_constants.py").write_text("GAIN = 1.0\n")
    return copy


def encode(package: Path, *before: str, **environment: str) -> tuple[float, bool]:
    """Run the kernel in a new process: its value, and whether it was compiled. before: words that start Python."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA_", "IIBR_"))}
    command, here = [*before, sys.executable, "-B", "-c", CALL], package.parent
    environment = {**clean, "PYTHONPATH": str(here), **environment}
    done = subprocess.run(command, env=environment, cwd=here, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    value, *messages = done.stdout.strip().split("|")
    assert set(messages) <= {COMPILING}
    return round(float(value), 5), bool(messages)


def kernels_in(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.rglob("*.nb?")}


def test_kernels_are_kept_and_compiled_again_where_an_inlined_file_is_edited(package) -> None:
    assert encode(package) == (0.01292, True)
    (package / "other.py").write_text("GAIN = 3.0\n")
    require_use_of_the_users_cache(package)
    scalars, constants = package / "runtime" / "scalars.py", package / "encoding_constants.py"
    scalars.write_text(scalars.read_text().replace("return x * 12.92", "return x * 100.0"))
    constants.write_text("GAIN = 2.0\n")
    assert encode(package) == (0.2, True)


def require_use_of_the_users_cache(package: Path) -> None:
    """An installation that cannot be written to is read, and what it lacks is kept in the user's cache."""
    shipped, cache = kernels_in(package / "_kernels"), package.parent / "cache"
    scratch = package.parent / "scratch"
    cache.mkdir()
    scratch.mkdir()
    folders = [package, *(path for path in package.rglob("*") if path.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    try:
        assert encode(package, *UNPRIVILEGED, XDG_CACHE_HOME=str(cache)) == (0.01292, False)
        assert encode(package, *UNPRIVILEGED, XDG_CACHE_HOME=str(cache), NUMBA_CPU_NAME="generic") == (0.01292, True)
        assert encode(package, *UNPRIVILEGED, XDG_CACHE_HOME=str(cache), NUMBA_CPU_NAME="generic") == (0.01292, False)
        nowhere = {"XDG_CACHE_HOME": "/nonexistent", "TMPDIR": str(scratch)}
        assert encode(package, *UNPRIVILEGED, **nowhere) == (0.01292, False)
    finally:
        for folder in folders:
            folder.chmod(0o755)
    assert not list(scratch.iterdir()), "a user without a home leaves nothing"
    assert kernels_in(package / "_kernels") == shipped
