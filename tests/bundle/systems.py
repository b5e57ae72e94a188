"""Small systems without Python, in which the package is installed and used as a person would."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

DEBIAN, UBUNTU = "http://deb.debian.org/debian", "http://archive.ubuntu.com/ubuntu"
SYSTEMS = {"bookworm": DEBIAN, "trixie": DEBIAN, "jammy": UBUNTU, "noble": UBUNTU}
"""Names of the releases, each with the address of its packages: Debian 12 and 13, Ubuntu 22.04 and 24.04."""
UBUNTU_KEYS = "./usr/share/keyrings/ubuntu-archive-keyring.gpg"
"""File of Debian 13 with the keys that Ubuntu's packages are signed by."""
HOMES = {"root": "/root", "ann": "/home/ann", "bob": "/nonexistent"}
"""Users and their home folders. Bob has none."""
CACHE = Path(__file__).parents[2] / "out" / "chroots"
"""Folder of base systems and of packages that were downloaded for them."""
DOWNLOADED = "var/cache/apt/archives"
MOUNTS = """
--dev /dev --proc /proc --perms 1777 --tmpfs /dev/shm --bind /tmp/.X11-unix /tmp/.X11-unix
--ro-bind /etc/resolv.conf /etc/resolv.conf --die-with-parent --cap-add ALL --chdir /photos --clearenv
"""
ENVIRONMENT = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LANG": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive"}
ENVIRONMENT |= {"LP_NUM_THREADS": "0", "SSL_CERT_FILE": "/etc/ssl/certs/ca-certificates.crt"}


def base_system(name: str) -> Path:
    """Return the archive of a release's smallest system; debootstrap makes it once."""
    archive, folder = CACHE / f"{name}.tar", CACHE / f"{name}-new"
    if archive.exists():
        return archive
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    options, script = ["--include=ubuntu-archive-keyring"] if name == "trixie" else [], "sid"
    if SYSTEMS[name] == UBUNTU:
        with (CACHE / "ubuntu-keys.gpg").open("wb") as keys:
            subprocess.run(["tar", "-xOf", base_system("trixie"), UBUNTU_KEYS], check=True, stdout=keys)
        options, script = ["--components=main,universe", f"--keyring={keys.name}"], "gutsy"
    script = f"/usr/share/debootstrap/scripts/{script}"
    subprocess.run(["debootstrap", "--variant=minbase", *options, name, folder, SYSTEMS[name], script], check=True)
    subprocess.run(["tar", "-C", folder, f"--exclude=./{DOWNLOADED}/*.deb", "-cf", f"{archive}.part", "."], check=True)
    Path(f"{archive}.part").rename(archive)
    shutil.rmtree(folder)
    return archive


@dataclass(frozen=True)
class CleanSystem:
    """A system in a folder. Its programs use the display of this machine; mounts live as long as each program."""

    name: str
    folder: Path

    @property
    def photos(self) -> Path:
        """Folder of photos, as this machine sees it; the system sees it as /photos."""
        return self.folder / "photos"

    def run(self, *words: str, user: str = "root", code: int = 0) -> str:
        """Run a program; return its output and messages. Raises AssertionError where it ends with another code."""
        done = subprocess.run(self._command(words, user), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert done.returncode == code, f"{' '.join(words)} ended with {done.returncode}: {done.stdout[-3000:]}"
        return done.stdout

    def start(self, *words: str, user: str) -> subprocess.Popen[bytes]:
        """Start a program."""
        return subprocess.Popen(self._command(words, user))

    def install(self, *packages: str) -> None:
        """Install packages with what they need but not what they recommend: a desktop has that."""
        self.run("apt-get", "update", "-qq")
        self.run("apt-get", "install", "-y", "-qq", "--no-install-recommends", *packages)

    def _command(self, words: tuple[str, ...], user: str) -> list[str]:
        archives = CACHE / f"{self.name}-packages"
        (archives / "partial").mkdir(parents=True, exist_ok=True)
        command = ["bwrap", "--bind", str(self.folder), "/", *MOUNTS.split(), "--bind", str(archives), f"/{DOWNLOADED}"]
        environment = {**ENVIRONMENT, "HOME": HOMES[user], "USER": user, "DISPLAY": os.environ.get("DISPLAY", "")}
        command += [word for name, value in environment.items() for word in ("--setenv", name, value)]
        if user != "root":  # root's packages bring certificates
            command += ["--ro-bind", "/etc/ssl/certs", "/etc/ssl/certs"]
            command += ["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups"]
        return [*command, *words]


@contextmanager
def clean_system(name: str) -> Iterator[CleanSystem]:
    """Unpack a system, add its users and a folder of photos that everybody may write to; remove it at the end."""
    with TemporaryDirectory(prefix=f"{name}-") as folder:
        system = CleanSystem(name, Path(folder))
        subprocess.run(["tar", "-C", folder, "-xpf", base_system(name)], check=True)
        system.photos.mkdir()
        system.photos.chmod(0o777)
        system.run("useradd", "--create-home", "ann")
        system.run("useradd", "--no-create-home", "--home-dir", HOMES["bob"], "bob")
        yield system
