"""Every command with its options, several at once, on hard inputs: exit code, words and files against a golden text.

`pytest --regenerate-golden` writes the texts again: read what has changed.
"""

import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.golden_rows import keep_row, read_rows
from tests.viewer.cli.conftest import contents
from tests.viewer.cli.described_files import described, difference
from tests.viewer.cli.hard_inputs import write_inputs

COMMANDS = {
    "screenshot-turned": [
        "screenshot turned.jpg --metric --depth-strength 3 -o a.png --grid 3x5 --view 1.2,-0.8"
        " --focus-at 26,28 --f-number 1.4 --blades 5 --rotation 20 --roundness 0.3 --highlights 2 --gps --bits 16",
        "screenshot turned.jpg --like a.png -o turned.jpg --force",
        "screenshot turned.jpg --like a.png -o b.jpg --picture-quality 40 --profile srgb --ring 0.6",
    ],
    "screenshot-full": [
        "screenshot turned.jpg -o c.tif --max-pixels 900 --full --view=-0.5,0.4 --tilt 0.5,-0.3"
        " --aperture 1.5",
    ],
    "screenshot-inverted": [
        "screenshot turned.jpg -o d.webp --max-pixels 900 --size 50x40 --invert-depth --grid 3"
        " --cat-eye 0.7 --focus 1 --aperture 9 --focus-range 0.2",
    ],
    "screenshot-hdr": [
        "screenshot hdr.exr -o e.exr --grid 4x3 --depth-strength 2 --view=-1,1 --mask mask.png"
        " --rotation=-30 --aperture 2 --focus-at 60,8 --backend osmesa --inpaint background",
    ],
    "screenshot-uneven": [
        "screenshot views -o f.png --view 0.5,-1.5 --focus 2 --aperture 2 --disparity hdr_disparity.pfm",
    ],
    "screenshot-glossy": [
        "screenshot field -o g.png --grid 4x3 --gloss gloss.toml --view 1,1 --tilt 99,0 --aperture 99",
    ],
    "screenshot-stretched": [
        "screenshot bare.png -o h.png --disparity narrow.npy --stretch --disparity-scale=-1"
        " --focus-disparity=-2 --grid 3 --refine off --view 1,0",
    ],
    "screenshot-woven": [
        "screenshot turned.jpg --calibration visual.json -o i.png --grid 1x5 --focus 0.5",
    ],
    "screenshot-pair": [
        "screenshot left.png right.png -o j.png --grid 3 --view 1,0",
    ],
    "generate-turned": [
        "generate turned.jpg --metric -o a --grid 2x3 --depth-strength 0.5 --with-disparity --gloss"
        " gloss.toml --refine off",
        "generate turned.jpg -o a --grid 2x3",
    ],
    "generate-hdr": [
        "generate hdr.exr -o b --grid 3x2 --literal --format hci --invert-depth",
    ],
    "generate-stretched": [
        "generate bare.png -o c_eslf.png --grid 3 --disparity narrow.npy --planned --stretch --format eslf",
    ],
    "generate-dense": [
        "generate views -o d --grid 7x5 --format hci",
    ],
    "generate-poses": [
        "generate hdr.exr -o e --poses poses.json --photo-pose 1",
    ],
    "generate-glossy": [
        "generate field -o f --grid 4x5 --with-disparity",
    ],
    "depth-metric": [
        "depth turned.jpg -o a.npy --refine off",
    ],
    "depth-inverted": [
        "depth turned.jpg -o b.png --invert-depth",
    ],
    "depth-rough": [
        "depth bare.png -o c.exr --depth rough --refine off",
    ],
    "depth-numbered": [
        "depth numbered -o found1.pfm --order columns --grid 4x3 --flip x",
    ],
    "depth-uneven": [
        "depth views -o found2.pfm",
    ],
    "depth-pair": [
        "depth left.png right.png -o found3.pfm",
    ],
    "plan-photos": [
        "plan turned.jpg",
        "plan turned.jpg --grid 5x7 --depth-strength 3 --focus-disparity 4 --max-pixels 900",
        "plan bare.png --depth flat",
        "plan hdr.exr --invert-depth --disparity-scale 2",
        "plan left.png right.png",
    ],
    "plan-views": [
        "plan views",
        "plan field --grid 4x3 --disparity hdr_disparity.pfm --disparity-scale 0.5",
    ],
    "export-gif": [
        "export turned.jpg --to gif -o a.gif --grid 3x5 --path keys.txt --frames 5 --rate 12 --size"
        " 36x54 --aperture 1",
        "export turned.jpg --to gif -o b.gif --grid 3 --motion rack --rack 2 -1 --frames 4 --f-number"
        " 0.9 --view 0.5,0",
    ],
    "export-half-sbs": [
        "export hdr.exr --to half-sbs -o c.png --grid 3x5 --eyes 2.5 --focus-at 26,28",
        "export hdr.exr --to half-sbs -o c.png --grid 3x5",
    ],
    "export-rgbd": [
        "export turned.jpg --to rgbd -o d.png --layout below",
    ],
    "export-focal-stack": [
        "export turned.jpg --to focal-stack -o e --grid 3 --frames 2 --bits 16 --view 0.5,0.5 --tilt 0.4,0",
    ],
    "export-epi": [
        "export field --to epi -o f.png --row 30",
    ],
    "export-web": [
        "export turned.jpg --to web -o g.html --grid 3x5 --budget 10kB",
        "export turned.jpg --to web -o g.html --grid 3x5 --budget 1MB --credit --aperture 1 --focus 0.2"
        " --focus-range 0.1",
        "export turned.jpg --to web -o n.html --for headset --show",
    ],
    "export-matte": [
        "export hdr.exr --to matte -o h.png --at 26,28 --tolerance 0.5",
    ],
    "export-depth-mask": [
        "export hdr.exr --to depth-mask -o i.png --focus 1 --focus-range 0.3 --soft 0.5",
    ],
    "export-depth": [
        "export turned.jpg --to depth -o k.npy",
    ],
    "export-npz": [
        "export hdr.exr --to npz -o l.npz --grid 3x2 --literal",
    ],
    "export-anaglyph": [
        "export views --to anaglyph -o m.png --eyes 1 --gloss gloss.toml",
    ],
    "screenshot-limited": [
        "screenshot hdr.exr --grid 3 -o a.png --blades 5",
        "screenshot hdr.exr --grid 3 -o b.png --tilt 0,99 --aperture 99 --f-number 0.1",
        "screenshot hdr.exr --grid 3 -o b.png --tilt 0,99 --aperture 99 --focus=-9",
    ],
    "generate-metric": [
        "generate bare.png -o a --grid 2x3 --disparity turned_depth.npy --planned --metric",
        "generate bare.png -o b --grid 2 --disparity hdr_disparity.pfm --disparity-scale=-0.5 --quality fast --out b",
        "generate hdr.exr -o c --grid 1x3 --disparity hdr_disparity.pfm --max-pixels 900",
    ],
    "plan-sheets": ["plan q_qs3x2a1.5.png", "plan a_eslf.png", "plan pair.jps", "plan x.top-bottom.jpg"],
    "export-blur": ["export turned.jpg --to blur -o a.exr --focus-at 26,28 --f-number 0.9"],
    "export-headset": ["export turned.jpg --to web -o a.html --for headset"],
    "export-disparity": ["export views --to disparity -o found.pfm"],
    "export-eslf": ["export field --to eslf -o b_eslf.png", "export field --to eslf -o b_eslf.png"],
    "export-hci": ["export hdr.exr --to hci -o a --grid 2x3 --depth-strength 0.5 --gloss gloss.toml"],
    "export-cross-eyed": [
        "export turned.jpg --to cross-eyed -o a.tif --grid 3 --eyes 1 --focus 0.2 --cat-eye 0.5 --aperture 2"
    ],
    "batch-maps": [
        "batch photos --to disparity -o a --grid 3x2 --depth rough --depth-strength 2 --invert-depth"
        " --workers 1",
    ],
    "batch-pairs": [
        "batch photos --to sbs -o b --grid 3x2 --depth rough --refine off --max-pixels 900 --eyes 1"
        " --literal --focus 0.3",
    ],
    "batch-loops": [
        "batch photos --to gif -o c --frames 3 --size 20x30 --f-number 2 --motion swing --focus-disparity 0",
    ],
    "evaluate": [
        "evaluate field -o report --views 2 --max-pixels 2000 --refine off --without outpainting",
    ],
    "open": [
        "open gone.png",
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A folder of all inputs, which no command changes."""
    folder = tmp_path_factory.mktemp("inputs")
    write_inputs(folder)
    return folder


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_do_and_say_what_they_did(iibr, inputs, tmp_path, monkeypatch, name, regenerate_golden):
    folder, before = shutil.copytree(inputs, tmp_path / "in"), contents(inputs)
    monkeypatch.chdir(folder)
    monkeypatch.setattr("iibr_core.exports.batch.ProcessPoolExecutor", lambda *_: ThreadPoolExecutor(1))
    for variable in ("PYTHONWARNINGS", "PYTHONSAFEPATH"):  # a batch sets them for its processes
        monkeypatch.setenv(variable, "")
    report = "\n".join(report_of(iibr, words) for words in COMMANDS[name]).replace(str(folder), "")
    if regenerate_golden:
        keep_row("commands", name, report.splitlines())
    assert difference(report, "\n".join(read_rows("commands")[name])) is None
    assert before.items() <= contents(folder).items(), "inputs stay as they are"


def report_of(iibr, words):
    """Run a command and return its words, and those of what it has written, as a text."""
    before = set(Path().iterdir())
    done = iibr(*words.split())
    said = [f"exit {done.returncode}", *done.stdout.splitlines(), *done.stderr.splitlines()]
    said = [re.sub(r"in \d+\.\d s", "in a while", line) for line in said if not line.startswith("libpng ")]
    files = [line for path in sorted(set(Path().iterdir()) - before) for line in described(path)]
    return "\n".join([f"$ iibr {words}", *said, *files, ""])
