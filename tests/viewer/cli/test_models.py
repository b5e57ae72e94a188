"""`iibr models`, and messages about the origin of depth."""

import pytest

from iibr_core.depth.models.known import KNOWN_MODELS
from tests.forked_iibr import run_forked
from tests.iibr_core.depth.onnx_graphs import of_channels
from tests.viewer.cli.conftest import output_of, refusal_of


def run_models(home, *words, typed=""):
    """Run a command in a process of its own, because the hub's library reads its address once; nobody listens there."""
    folders = dict.fromkeys(("HF_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME"), str(home))
    return run_forked(*words, cwd=home, typed=typed, HF_ENDPOINT="http://127.0.0.1:9", **folders)


def test_models_are_listed_with_size_and_licence_and_a_file_of_ones_own_is_added(photo_path, tmp_path):
    file = of_channels(tmp_path / "metres.onnx", farness=True)
    copied = output_of(run_models(tmp_path, "models", "get", file)).splitlines()
    assert copied[-1] == "Use it: iibr view PHOTO --depth-model metres"
    file.unlink()
    *lines, _, _ = output_of(run_models(tmp_path, "models")).splitlines()
    *known, own = (line for line in lines if not line.startswith(" "))
    for model, line in zip(KNOWN_MODELS, known, strict=True):
        assert all(part in line for part in (f"{model.name} ", f"{model.megabytes:,} MB", model.licence, "not here"))
        assert f"Good for {model.good_for}." in lines[lines.index(line) + 1]
    assert own.startswith("metres ")
    output_of(run_models(tmp_path, "depth", photo_path, "--depth-model", "metres", "-o", "map.npy"))


def test_without_a_network_get_is_one_line(tmp_path):
    done = run_models(tmp_path, "models", "get", "depth-anything-v2-small", "--yes")
    about, error = done.stderr.splitlines()
    assert done.returncode == 2
    assert "99 MB, Apache-2.0" in about
    assert error.startswith("iibr: Depth Anything V2 Small cannot be downloaded: ")
    assert "network" in error
    assert not list(tmp_path.rglob("*.safetensors"))


@pytest.mark.parametrize(("typed", "code", "message"), [("\n", 1, "Nothing was downloaded"), ("", 130, "interrupted")])
def test_nothing_is_fetched_unless_the_user_says_yes(tmp_path, typed, code, message):
    done = run_models(tmp_path, "models", "get", "depth-anything-v2-small", typed=typed)
    assert done.returncode == code
    assert message in done.stderr
    assert "cannot be downloaded" not in done.stderr


def test_commands_name_the_origin_of_depth_and_refuse_a_bad_model(iibr, photo_path, tmp_path):
    words = ("generate", photo_path, "--grid", 1, "-o")
    assert "note: Depth: scene_disparity.npy." in iibr(*words, tmp_path / "a").stderr
    (model := tmp_path / "model").mkdir()
    assert "config.json" in refusal_of(iibr(*words, tmp_path / "c", "--depth", "model", "--depth-model", model))
    unknown = refusal_of(iibr("models", "get", "depth-nothing"))
    assert all(model.name in unknown for model in KNOWN_MODELS)
    assert "depth-anything-v2-base" in refusal_of(iibr("plan", photo_path, "--depth-model", "depth-anything-v2-base"))
