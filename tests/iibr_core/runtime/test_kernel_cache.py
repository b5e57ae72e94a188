"""Kernels kept on disk, in a small copy of the package whose files are edited between two processes."""

import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import iibr_core
from iibr_core.runtime import kernel_cache
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.kernel_cache import PROCESSOR, PROCESSOR_FEATURES, numba

ENCODING = """
from iibr_core.encoding_constants import GAIN
from iibr_core.runtime.jit import kernel, srgb_scalar


@kernel
def encode(linear):
    return _encode(linear) * GAIN


@kernel
def _encode(linear):
    return srgb_scalar(linear)
"""
CALL = """
from iibr_core.encoding import encode
value = encode(0.001)
print(value, sum(encode.stats.cache_hits.values()) if hasattr(encode, "stats") else 0)
"""


@pytest.fixture
def package(tmp_path):
    """A copy of the package with what kernels need, and one kernel that uses things of other files."""
    return make_package(tmp_path)


def make_package(folder):
    source = Path(iibr_core.__file__).parent
    copy = folder / "iibr_core"
    needed = (
        "__init__",
        "runtime/__init__",
        "runtime/compiling",
        "runtime/jit",
        "runtime/kernel_cache",
        "runtime/offers",
    )
    for name in (f"{name}.py" for name in (*needed, "runtime/time_left")):
        (copy / name).parent.mkdir(exist_ok=True, parents=True)
        (copy / name).write_text((source / name).read_text())
    (copy / "encoding.py").write_text(ENCODING)
    (copy / "encoding_constants.py").write_text("GAIN = 1.0\n")
    return copy


# Root may write everywhere, unless it gives that up.
WITHOUT_PRIVILEGES = ("setpriv", "--bounding-set=-all", "--inh-caps=-all") if os.geteuid() == 0 else ()


def encode_in_new_process(package, *before, cwd=None, preexec_fn=None, **environment):
    """(what the kernel gives, whether it came from the disk). before: words that start Python."""
    kept = {**os.environ, "PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": str(package.parent / "kept")}
    run = subprocess.run(
        [*before, sys.executable, "-c", CALL],
        env=kept | environment,
        cwd=cwd or package.parent,
        capture_output=True,
        text=True,
        preexec_fn=preexec_fn,
    )
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    value, hits = run.stdout.split()
    return float(value), hits == "1"


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def kept_files(package):
    return sorted(path.name for path in (package.parent / "kept").rglob("*.nb?"))


def test_an_edit_of_an_inlined_file_is_noticed(package):
    assert encode_in_new_process(package) == (pytest.approx(0.01292), False)
    files = kept_files(package)
    (package / "other.py").write_text("GAIN = 3.0\n")
    assert encode_in_new_process(package) == (pytest.approx(0.01292), True), "the kernel imports no such file"

    edit(package / "runtime" / "jit.py", "return x * 12.92", "return x * 100.0")
    assert encode_in_new_process(package) == (pytest.approx(0.1), False)
    edit(package / "encoding_constants.py", "1.0", "2.0")
    edit(package / "encoding.py", "\n\n\n@kernel", "\n\n\n# lines move\n\n\n@kernel")
    assert encode_in_new_process(package) == (pytest.approx(0.2), False)
    assert kept_files(package) == files, "old entries are overwritten"


def cut_off(path):
    path.write_bytes(path.read_bytes()[:-20])


def empty(path):
    path.write_bytes(b"")


def overwrite_with_garbage(path):
    path.write_bytes(b"\x80garbage" * 1000)


def lose_a_block(path):
    """As power that fails does: the length is right, and zeros where code was."""
    data = bytearray(path.read_bytes())
    start = len(data) // 2
    data[start : start + 512] = bytes(len(data[start : start + 512]))
    path.write_bytes(data)


def become_a_folder(path):
    path.unlink()
    (path / "inside").mkdir(parents=True)


def plus_one(value):
    return value + 1.0


def run_anew():
    """Whether the kernel came from the disk, as in a new process."""
    compiled = kernel(plus_one)
    assert compiled(1.0) == 2.0
    return bool(compiled.stats.cache_hits)


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [cut_off, empty, overwrite_with_garbage, lose_a_block, become_a_folder, Path.unlink])
def test_a_damaged_entry_is_a_miss_and_goes(tmp_path, monkeypatch, damage, ending):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    assert not run_anew()
    files = sorted(tmp_path.rglob("*.nb?"))
    (path,) = (file for file in files if file.suffix == f".{ending}")
    damage(path)
    assert not run_anew()
    assert run_anew(), "it was written again"
    assert sorted(tmp_path.rglob("*.nb?")) == files


def test_processes_that_save_at_the_same_time_keep_each_kind_apart(tmp_path, monkeypatch):
    """The second has read the index before the first has written it."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    row, square = np.zeros(2), np.zeros((2, 2))
    kernel(plus_one)(row)
    (index,) = tmp_path.rglob("*.nbi")
    of_first = index.read_bytes()
    index.unlink()
    kernel(plus_one)(square)
    index.write_bytes(of_first)
    np.testing.assert_array_equal(kernel(plus_one)(row), row + 1)


def test_a_full_disk_leaves_nothing_and_stops_nothing(package):
    def fill_disk():
        resource.setrlimit(resource.RLIMIT_FSIZE, (300, 300))

    assert encode_in_new_process(package, preexec_fn=fill_disk) == (pytest.approx(0.01292), False)
    assert kept_files(package) == []
    assert [path for path in (package.parent / "kept").rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("home", [None, "", os.devnull, "/proc"])
def test_a_read_only_installation_runs_wherever_home_is(package, home):
    shutil.rmtree(package / "runtime" / "__pycache__", ignore_errors=True)
    for folder in (package, package / "runtime"):
        folder.chmod(0o500)
    given = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": os.devnull} | ({} if home is None else {"HOME": home})
    words = (*WITHOUT_PRIVILEGES, *(("env", "-u", "HOME") if home is None else ()))
    assert encode_in_new_process(package, *words, **given) == (pytest.approx(0.01292), False)
    for folder in (package, package / "runtime"):
        folder.chmod(0o700)


@pytest.mark.parametrize("text", ["cache_dir: {}\n", "[: no YAML"])
def test_the_working_folder_names_no_place_to_take_code_from(package, tmp_path, text):
    """Numba reads `.numba_config.yaml` there, and runs what it finds in the cache that it names."""
    strange = tmp_path / "downloads"
    strange.mkdir()
    (strange / ".numba_config.yaml").write_text(text.format(strange / "cache"))
    assert encode_in_new_process(package, cwd=strange, NUMBA_CACHE_DIR="") == (pytest.approx(0.01292), False)
    assert [path.name for path in strange.iterdir()] == [".numba_config.yaml"]


@pytest.mark.parametrize("before", ["", "import scipy.linalg; "])
def test_kernels_do_without_scipy_and_leave_it_to_others(before):
    code = f"{before}import sys; from iibr_core.color import linear_from_srgb; import numpy as np"
    code += (
        "; linear_from_srgb(np.zeros((2, 2, 3), np.float32)); print('scipy' in sys.modules); import scipy.ndimage, yaml"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (run.stdout, run.stderr) == (f"{bool(before)}\n", "")


def test_without_a_place_to_keep_them_kernels_run(package):
    (package.parent / "file").write_text("")
    nowhere = str(package.parent / "file" / "folder")
    locators = {"NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator", "NUMBA_CACHE_DIR": nowhere}
    assert encode_in_new_process(package, **locators) == (pytest.approx(0.01292), False)


def test_kernels_run_without_compiler(package):
    assert encode_in_new_process(package, NUMBA_DISABLE_JIT="1") == (pytest.approx(0.01292), False)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A package whose kernels have been run, and are kept."""
    package = make_package(tmp_path_factory.mktemp("compiled"))
    encode_in_new_process(package)
    return package


@pytest.fixture
def equipped(compiled, tmp_path):
    """The package with its kernels compiled, at another place than where they were, and no cache of the user's."""
    package = compiled
    place = tmp_path / "elsewhere" / "iibr_core"
    shutil.copytree(package, place, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in (package, package / "runtime"):
        subpath = numba.core.caching._CacheLocator.get_suitable_cache_subpath(str(folder / "jit.py"))
        shutil.copytree(package.parent / "kept" / subpath, place / "_kernels" / folder.relative_to(package))
    return place


def test_kernels_that_come_along_are_not_compiled(equipped):
    assert encode_in_new_process(equipped) == (pytest.approx(0.01292), True)
    assert kept_files(equipped) == []


def test_kernels_that_come_along_serve_where_nothing_can_be_written(equipped):
    for folder in (equipped, equipped / "runtime"):
        folder.chmod(0o500)
    nowhere = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": os.devnull, "HOME": os.devnull}
    assert encode_in_new_process(equipped, *WITHOUT_PRIVILEGES, **nowhere) == (pytest.approx(0.01292), True)
    for folder in (equipped, equipped / "runtime"):
        folder.chmod(0o700)


def test_kernels_that_come_along_do_not_count_for_other_sources_or_processors(equipped):
    before = kernel_files_along(equipped)
    assert encode_in_new_process(equipped, NUMBA_CPU_NAME="generic") == (pytest.approx(0.01292), False)
    edit(equipped / "encoding_constants.py", "1.0", "2.0")
    assert encode_in_new_process(equipped) == (pytest.approx(0.02584), False)
    assert encode_in_new_process(equipped) == (pytest.approx(0.02584), True), "now from the user's"
    assert kernel_files_along(equipped) == before


@pytest.mark.parametrize("damage", [cut_off, empty, overwrite_with_garbage, lose_a_block])
def test_damaged_kernels_that_come_along_are_a_miss(equipped, damage):
    for path in (equipped / "_kernels").glob("encoding.encode.*"):
        damage(path)
    before = kernel_files_along(equipped)
    assert encode_in_new_process(equipped) == (pytest.approx(0.01292), False)
    assert kernel_files_along(equipped) == before


def kernel_files_along(package):
    return {path: path.read_bytes() for path in (package / "_kernels").rglob("*.nb?")}


def numba_with(features, **config):
    """As much of Numba as knows the processor."""
    core = SimpleNamespace(
        config=SimpleNamespace(**({"CPU_NAME": None, "CPU_FEATURES": None} | config)),
        codegen=SimpleNamespace(get_host_cpu_features=lambda: features),
    )
    return SimpleNamespace(core=core)


LEVEL_3 = ",".join(f"+{name}" for name in sorted(PROCESSOR_FEATURES))


@pytest.mark.parametrize(
    ("fake", "name"),
    [
        (numba_with(f"{LEVEL_3},+avx512f,-amx-tile"), PROCESSOR),
        (numba_with(LEVEL_3.replace("+avx2", "-avx2")), None),
        (numba_with("+neon,+fp-armv8"), None),
        (numba_with(""), None),
        (numba_with(LEVEL_3, CPU_NAME="generic"), "generic"),
        (numba_with(LEVEL_3, CPU_FEATURES="+sse4.2"), None),
    ],
    ids=["newer", "older", "arm", "unknown", "named", "features named"],
)
def test_kernels_are_compiled_for_one_kind_of_processor_where_this_one_is_of_that_kind(fake, name):
    kernel_cache._choose_processor(fake)
    config = fake.core.config
    assert (config.CPU_NAME, config.CPU_FEATURES == "") == (name, name == PROCESSOR)
