"""Where files and folders may be written: never onto what is read, through links, whole; what a killed process left."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest

from iibr_core.formats.outputs import (
    AlreadyThereError,
    UnfinishedFolder,
    atomic_write,
    make_folder,
    release_place,
    require_file_place,
    require_files_in,
    require_folder_place,
)
from iibr_core.formats.unfinished import remove_leftovers
from iibr_core.types import InputError

NOBODY = 65534
THEIRS = 'case "$1" in *.txt) echo theirs > "$1";; *) mkdir "$1" && echo theirs > "$1/a.txt";; esac'


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def write(path: Path, text: str) -> None:
    with atomic_write(path) as temporary:
        temporary.write_text(text)


def write_folder(folder: Path, text: str) -> None:
    unfinished = UnfinishedFolder(folder)
    try:
        (unfinished.path / "a.txt").write_text(text)
        unfinished.put_in_place()
    finally:
        unfinished.discard()


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    """A photo in a light field, links to it, and an empty folder."""
    (tmp_path / "field" / "views").mkdir(parents=True)
    photo = tmp_path / "field" / "photo.png"
    photo.write_text("photo")
    (tmp_path / "field" / "views" / "0.png").write_text("view")
    (tmp_path / "link.png").symlink_to(photo)
    (tmp_path / "second.png").symlink_to("link.png")
    (tmp_path / "hard.png").hardlink_to(photo)
    (tmp_path / "linked-field").symlink_to("field")
    (tmp_path / "elsewhere").mkdir()
    return photo


@pytest.mark.parametrize(
    "name",
    ["field/photo.png", "field/../field/photo.png", "link.png", "second.png", "hard.png", "linked-field/photo.png"],
)
def test_no_file_is_written_onto_an_input_whatever_its_name(photo: Path, tmp_path: Path, name: str) -> None:
    for read in (photo, tmp_path / "second.png"):
        with pytest.raises(InputError, match="is read here") as caught:
            require_file_place(tmp_path / name, [read], may_replace=True)
        assert not isinstance(caught.value, AlreadyThereError)
        assert "\n" not in str(caught.value)


def test_paths_are_the_same_file_however_they_begin(
    photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(photo.parent)
    for path, read in ((Path("photo.png"), photo), (photo, Path("photo.png")), (Path("../field/photo.png"), photo)):
        with pytest.raises(InputError, match="is read here"):
            require_file_place(path, [read], may_replace=True)
    require_file_place(Path("other.png"), [Path("photo.png")])


@pytest.mark.parametrize("read", ["field", "linked-field", "."])
@pytest.mark.parametrize("name", ["field/new.png", "linked-field/views/new.png", "field/views/0.png"])
def test_no_file_is_written_into_a_folder_that_is_read(photo: Path, tmp_path: Path, name: str, read: str) -> None:
    with pytest.raises(InputError, match=r"lies in .*, which is read"):
        require_file_place(tmp_path / name, [tmp_path / read], may_replace=True)


def test_no_file_is_written_onto_what_a_folder_that_is_read_links_to(photo: Path, tmp_path: Path) -> None:
    outside = tmp_path / "elsewhere" / "1.png"
    outside.write_text("view")
    require_file_place(outside, [photo.parent], may_replace=True)
    (tmp_path / "field" / "views" / "1.png").symlink_to(outside)
    with pytest.raises(InputError, match="is read here"):
        require_file_place(outside, [photo.parent], may_replace=True)
    (tmp_path / "field" / "views" / "1.png").unlink()
    (tmp_path / "field" / "views" / "1.png").hardlink_to(outside)
    with pytest.raises(InputError, match="is read here"):
        require_file_place(outside, [photo.parent], may_replace=True)


@pytest.mark.parametrize("read", ["field/photo.png", "link.png", "second.png", "linked-field/photo.png", "field/views"])
@pytest.mark.parametrize("name", ["field", "linked-field", "field/../field", "."])
def test_no_folder_is_replaced_that_holds_an_input(photo: Path, tmp_path: Path, name: str, read: str) -> None:
    with pytest.raises(InputError, match=r"holds .*, which is read"):
        require_folder_place(tmp_path / name, [tmp_path / read], may_replace=True, is_whole=True)


def test_a_link_in_a_folder_is_an_input_too(photo: Path, tmp_path: Path) -> None:
    """Replacing its folder would take it away, wherever it leads."""
    (tmp_path / "elsewhere" / "input.png").symlink_to(photo)
    for read in (tmp_path / "elsewhere" / "input.png", tmp_path / "through.png"):
        (tmp_path / "through.png").unlink(missing_ok=True)
        (tmp_path / "through.png").symlink_to("elsewhere/input.png")
        with pytest.raises(InputError, match="holds"):
            require_folder_place(tmp_path / "elsewhere", [read], may_replace=True, is_whole=True)


@pytest.mark.parametrize("name", ["field", "field/new", "linked-field/new/deep", "field/views"])
def test_no_folder_is_written_into_one_that_is_read(photo: Path, tmp_path: Path, name: str) -> None:
    for is_whole in (True, False):
        with pytest.raises(InputError, match=r"lies in .*, which is read"):
            require_folder_place(tmp_path / name, [tmp_path / "field"], may_replace=True, is_whole=is_whole)


def test_what_is_there_is_replaced_only_where_that_is_allowed(photo: Path, tmp_path: Path) -> None:
    with pytest.raises(AlreadyThereError, match=r"link\.png: already exists; give --force"):
        require_file_place(tmp_path / "link.png")
    with pytest.raises(AlreadyThereError, match=r"field: already exists; give --force"):
        require_folder_place(tmp_path / "field")
    require_file_place(photo, may_replace=True)
    require_folder_place(tmp_path / "field", may_replace=True)
    require_folder_place(tmp_path / "elsewhere", [photo])
    require_folder_place(tmp_path / "elsewhere", [photo], is_whole=True)


def test_a_file_of_a_folder_may_not_lead_to_an_input(photo: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere" / "report.md").symlink_to(photo)
    with pytest.raises(InputError, match=r"report\.md: is read here"):
        require_files_in(tmp_path / "elsewhere", ["report.md"], [photo], may_replace=True)
    require_files_in(tmp_path / "elsewhere", ["report.json"], [photo], may_replace=True)
    (tmp_path / "elsewhere" / "report.json").mkdir()
    with pytest.raises(InputError, match=r"report\.json: is a folder"):
        require_files_in(tmp_path / "elsewhere", ["report.json"], may_replace=True)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("gone/a.png", "gone does not exist"),
        ("field/photo.png/a.png", "photo.png does not exist"),
        ("field", "is a folder, not a file"),
        ("n" * 252 + ".png", "a name has 256 bytes"),
        ("ä" * 126 + ".png", "a name has 256 bytes"),
        ("nul\0.png", "is not a place to write to"),
        ("loop", "lead in a circle"),
        ("pipe", "is a device or a pipe"),
    ],
)
def test_places_where_no_file_can_be(photo: Path, tmp_path: Path, name: str, reason: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    before = names(tmp_path)
    with pytest.raises(InputError, match=reason) as caught:
        require_file_place(tmp_path / name, may_replace=True)
    assert "\n" not in str(caught.value)
    assert names(tmp_path) == before


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("field/photo.png", "is a file, not a folder"),
        ("field/photo.png/new", "photo.png is a file"),
        ("new/" + "n" * 256, "a name has 256 bytes"),
        ("gone-disk/field", "gone-disk is a broken link"),
        ("gone-disk", "gone-disk is a broken link"),
        ("loop", "lead in a circle"),
    ],
)
def test_places_where_no_folder_can_be(photo: Path, tmp_path: Path, name: str, reason: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "gone-disk").symlink_to("not-mounted/disk")
    for is_whole in (True, False):
        with pytest.raises(InputError, match=reason):
            require_folder_place(tmp_path / name, may_replace=True, is_whole=is_whole)


def test_a_name_as_long_as_the_system_allows(tmp_path: Path) -> None:
    name = "n" * 251 + ".png"
    require_file_place(tmp_path / name)
    write(tmp_path / name, "one")
    write_folder(tmp_path / ("f" * 255), "two")
    assert names(tmp_path) == ["f" * 255, name]


@pytest.mark.parametrize("is_there", [True, False])
def test_links_are_followed_and_stay(tmp_path: Path, is_there: bool) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "here").mkdir()
    if is_there:
        (tmp_path / "disk" / "a.txt").write_text("before")
        (tmp_path / "disk" / "folder").mkdir()
    (tmp_path / "here" / "a.txt").symlink_to("../disk/a.txt")
    (tmp_path / "here" / "folder").symlink_to("../disk/folder")
    require_file_place(tmp_path / "here" / "a.txt", may_replace=True)
    require_folder_place(tmp_path / "here" / "folder", is_whole=True)
    write(tmp_path / "here" / "a.txt", "after")
    write_folder(tmp_path / "here" / "folder", "within")
    assert (tmp_path / "disk" / "a.txt").read_text() == "after"
    assert (tmp_path / "disk" / "folder" / "a.txt").read_text() == "within"
    assert all((tmp_path / "here" / name).is_symlink() for name in ("a.txt", "folder"))
    assert names(tmp_path / "here") == names(tmp_path / "disk") == ["a.txt", "folder"]


def test_a_folder_is_made_where_a_link_leads(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("real")
    make_folder(tmp_path / "link")
    assert (tmp_path / "real").is_dir()
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be created"):
        make_folder(tmp_path / "file" / "folder")


def test_a_folder_is_replaced_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "made" / "folder"
    for text in ("one", "two"):
        write_folder(folder, text)
        assert (folder / "a.txt").read_text() == text
    unfinished = UnfinishedFolder(folder)
    (unfinished.path / "b.txt").write_text("half")
    unfinished.discard()
    assert names(folder) == ["a.txt"]
    assert names(tmp_path / "made") == ["folder"]


KILLED = """
import os, signal, sys
from pathlib import Path
from iibr_core.formats import outputs, unfinished
folder = Path(sys.argv[1])
def end():
    os.kill(os.getpid(), signal.SIGKILL)
def writing():
    with outputs.atomic_write(folder / "file.txt") as temporary:
        temporary.write_text("half")
        end()
def half_a_folder():
    outputs.UnfinishedFolder(folder / "field").path.joinpath("a.txt").write_text("half")
    end()
def between_two_renames():
    rename = Path.rename
    def rename_once(self, target):
        rename(self, target)
        end()
    Path.rename = rename_once
    unfinished = outputs.UnfinishedFolder(folder / "field")
    (unfinished.path / "a.txt").write_text("new")
    unfinished.put_in_place()
def before_the_old_one_is_gone():
    unfinished = outputs.UnfinishedFolder(folder / "field")
    (unfinished.path / "a.txt").write_text("new")
    unfinished.put_in_place()
    end()
def remove_leftovers():
    unfinished.remove_leftovers(folder)
globals()[sys.argv[2]]()
"""


def killed(folder: Path, where: str) -> Path:
    """What is left in a folder of a process that was killed there."""
    done = subprocess.run([sys.executable, "-c", KILLED, str(folder), where], check=False)
    assert done.returncode == -signal.SIGKILL
    (left,) = [path for path in folder.iterdir() if path.name.startswith(".")]
    return left


@pytest.mark.parametrize(
    ("where", "kept"),
    [
        ("writing", "old"),
        ("half_a_folder", "old"),
        ("between_two_renames", "old"),
        ("before_the_old_one_is_gone", "new"),
    ],
)
@pytest.mark.parametrize("looks", [remove_leftovers, lambda folder: write(folder / "next.txt", "next")])
def test_the_next_one_tidies_up_after_a_killed_process(
    tmp_path: Path, where: str, kept: str, looks: Callable[[Path], None]
) -> None:
    write_folder(tmp_path / "field", "old")
    killed(tmp_path, where)
    looks(tmp_path)
    assert set(names(tmp_path)) - {"next.txt"} == {"field"}
    assert (tmp_path / "field" / "a.txt").read_text() == kept


def test_what_was_there_comes_back_before_anybody_asks_whether_it_is(tmp_path: Path) -> None:
    write_folder(tmp_path / "field", "old")
    killed(tmp_path, "between_two_renames")
    assert not (tmp_path / "field").exists()
    with pytest.raises(AlreadyThereError):
        require_folder_place(tmp_path / "field", is_whole=True)


def test_what_was_moved_aside_is_kept_where_another_took_its_name(tmp_path: Path) -> None:
    write_folder(tmp_path / "field", "old")
    left = killed(tmp_path, "between_two_renames")
    (tmp_path / "field").mkdir()
    remove_leftovers(tmp_path)
    assert (left / "old" / "field" / "a.txt").read_text() == "old"
    (tmp_path / "field").rmdir()
    remove_leftovers(tmp_path)
    assert names(tmp_path) == ["field"]
    assert (tmp_path / "field" / "a.txt").read_text() == "old"


def test_what_is_being_written_is_no_leftover(tmp_path: Path) -> None:
    unfinished = UnfinishedFolder(tmp_path / "field")
    with atomic_write(tmp_path / "a.txt") as temporary:
        remove_leftovers(tmp_path)
        subprocess.run([sys.executable, "-c", KILLED, str(tmp_path), "remove_leftovers"], check=True)
        temporary.write_text("whole")
    unfinished.put_in_place()
    unfinished.discard()
    assert names(tmp_path) == ["a.txt", "field"]


def test_foreign_hidden_files_are_left_alone(tmp_path: Path) -> None:
    kept = [".iibr-notes", ".iibr-0123456789abcdef.a b", ".field.0123456789ab", ".iibr-0123456789ABCDEF"]
    for name in kept:
        (tmp_path / name).touch()
    (tmp_path / ".iibr-0123456789abcdef").symlink_to(tmp_path / ".iibr-notes")
    remove_leftovers(tmp_path)
    assert names(tmp_path) == sorted([*kept, ".iibr-0123456789abcdef"])


def test_half_a_file_leaves_what_was_there(tmp_path: Path) -> None:
    write(tmp_path / "a.txt", "before")
    with suppress(RuntimeError), atomic_write(tmp_path / "a.txt") as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert (tmp_path / "a.txt").read_text() == "before"
    assert names(tmp_path) == ["a.txt"]


AS_NOBODY = """
import os, sys
from pathlib import Path
from iibr_core.formats import files, outputs, unfinished
from iibr_core.types import InputError
if os.getuid() == 0:
    os.setgroups([]); os.setgid(int(sys.argv[2])); os.setuid(int(sys.argv[2]))
closed, sealed = Path(sys.argv[1]) / "closed", Path(sys.argv[1]) / "sealed"
for look in (
    lambda: files.is_file(closed / "a.png"),
    lambda: files.is_folder(closed / "folder"),
    lambda: files.require_file(closed / "a.png"),
    lambda: files.entries_of(closed),
    lambda: outputs.require_file_place(closed / "a.png"),
    lambda: outputs.require_folder_place(closed / "new"),
    lambda: outputs.require_file_place(sealed / "a.png"),
    lambda: outputs.require_folder_place(sealed / "new"),
    lambda: outputs.require_folder_place(sealed / "empty", is_whole=True),
    lambda: outputs.UnfinishedFolder(sealed / "new"),
    lambda: outputs.make_folder(sealed / "new"),
    lambda: outputs.atomic_write(sealed / "a.png").__enter__(),
):
    try:
        look()
        print("nothing was refused")
    except InputError as error:
        print(error)
unfinished.remove_leftovers(closed)
"""


@pytest.fixture
def public_folder() -> Iterator[Path]:
    """One that every user may look into, as not into pytest's."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


def test_folders_without_permission_are_refused_in_one_line(public_folder: Path) -> None:
    """closed: nobody may look into it; sealed: nobody may write there."""
    for name, mode in (("closed", 0o600), ("sealed", 0o555)):
        (public_folder / name / "empty").mkdir(parents=True)
        (public_folder / name).chmod(mode)
    command = [sys.executable, "-c", AS_NOBODY, str(public_folder), str(NOBODY)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[3])
    (public_folder / "closed").chmod(0o755)
    (public_folder / "sealed").chmod(0o755)
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert len(lines) == 12
    assert all(line.startswith(str(public_folder)) for line in lines)


def test_a_place_that_was_free_is_not_taken_from_another_program(tmp_path: Path) -> None:
    """Somebody else writes there between the question and the answer; asked again, it may be replaced."""
    for place in (tmp_path / "a.txt", tmp_path / "folder"):
        put = write if place.suffix else write_folder
        require = require_file_place if place.suffix else partial(require_folder_place, is_whole=True)
        require(place)
        subprocess.run(["sh", "-c", THEIRS, "sh", place], check=True)
        with pytest.raises(AlreadyThereError, match="another program") as caught:
            put(place, "mine")
        assert "\n" not in str(caught.value)
        found = place if place.suffix else place / "a.txt"
        assert found.read_text() == "theirs\n"
        require(place, may_replace=True)
        put(place, "mine")
        assert found.read_text() == "mine"
        put(place, "mine again")
    assert names(tmp_path) == ["a.txt", "folder"]


def test_each_new_file_of_a_folder_is_not_taken_either(tmp_path: Path) -> None:
    require_files_in(tmp_path / "report", ["a.txt", "b.txt"])
    make_folder(tmp_path / "report")
    write(tmp_path / "report" / "a.txt", "mine")
    (tmp_path / "report" / "b.txt").write_text("theirs")
    with pytest.raises(AlreadyThereError, match="another program"):
        write(tmp_path / "report" / "b.txt", "mine")
    assert [(tmp_path / "report" / name).read_text() for name in ("a.txt", "b.txt")] == ["mine", "theirs"]


def test_a_new_file_needs_no_hard_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a memory card."""

    def refuse(*_: object) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", refuse)
    for text in ("one", "two"):
        require_file_place(tmp_path / "a.txt", may_replace=text == "two")
        write(tmp_path / "a.txt", text)
        assert (tmp_path / "a.txt").read_text() == text
    require_file_place(tmp_path / "b.txt")
    (tmp_path / "b.txt").write_text("theirs")
    with pytest.raises(AlreadyThereError, match="another program"):
        write(tmp_path / "b.txt", "mine")


CLAIMING = """
import sys
from pathlib import Path
from functools import partial
from iibr_core.formats import outputs
from iibr_core.types import InputError
place = Path(sys.argv[1])
require = outputs.require_file_place if place.suffix else partial(outputs.require_folder_place, is_whole=True)
try:
    require(place, may_replace=sys.argv[2] == "replaces")
    print("claimed", flush=True)
except InputError as error:
    print(error, flush=True)
sys.stdin.read()
"""


def claim_in_process(place: Path, *, may_replace: bool = False) -> subprocess.Popen[str]:
    """It has asked, and waits for the end of its input."""
    command = [sys.executable, "-c", CLAIMING, str(place), "replaces" if may_replace else ""]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def said_by(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


@pytest.mark.parametrize("name", ["a.png", "field", "new/deep/field"])
def test_the_second_process_at_a_new_place_is_told_at_once(tmp_path: Path, name: str) -> None:
    place = tmp_path / name
    with claim_in_process(place) as first:
        assert said_by(first) == "claimed"
        for may_replace in (False, True):
            with claim_in_process(place, may_replace=may_replace) as second:
                said = "claimed" if may_replace else f"{place}: another program is writing it"
                assert said_by(second).startswith(said)
        with claim_in_process(tmp_path / "other.png") as beside:
            assert said_by(beside) == "claimed"
    assert names(tmp_path) == [], "who ends without writing leaves nothing"


def test_the_claim_of_a_killed_process_holds_nobody_back(tmp_path: Path) -> None:
    with claim_in_process(tmp_path / "new" / "field") as first:
        assert said_by(first) == "claimed"
        first.kill()
    (left,) = names(tmp_path)
    assert left.endswith(".claim")
    require_folder_place(tmp_path / "new" / "field", is_whole=True)
    assert names(tmp_path) == [left]
    write_folder(tmp_path / "new" / "field", "mine")
    assert names(tmp_path) == ["new"]


def test_a_place_that_is_given_up_is_free(tmp_path: Path) -> None:
    for _ in range(2):
        require_file_place(tmp_path / "a.png")
    release_place(tmp_path / "a.png")
    assert names(tmp_path) == []
    with claim_in_process(tmp_path / "a.png") as other:
        assert said_by(other) == "claimed"
        with pytest.raises(InputError, match="another program is writing it"):
            require_file_place(tmp_path / "a.png")
