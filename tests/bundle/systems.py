"""Small systems without Python, in which the package is installed and used as a person would."""

from __future__ import annotations

import shutil
import subprocess
import tarfile
from dataclasses import dataclass
from pathlib import Path

DEBIAN, UBUNTU = "http://deb.debian.org/debian", "http://archive.ubuntu.com/ubuntu"
SYSTEMS = {"bookworm": DEBIAN, "trixie": DEBIAN, "jammy": UBUNTU, "noble": UBUNTU}
"""Names of the releases, each with the address of its packages: Debian 12 and 13, Ubuntu 22.04 and 24.04."""
UBUNTU_KEYS = "./usr/share/keyrings/ubuntu-archive-keyring.gpg"
"""File of Debian 13 with the keys that Ubuntu's packages are signed by."""
USERS = {"root": 0, "ann": 1000, "bob": 1001}
"""Users and their numbers. Bob has no home folder."""
DOWNLOADED = "var/cache/apt/archives"


def base_system(name: str, cache: Path) -> Path:
    """Return the archive of a release's smallest system; debootstrap makes it once."""
    archive, folder = cache / f"{name}.tar", cache / f"{name}-new"
    if archive.exists():
        return archive
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    options, script = ["--include=ubuntu-archive-keyring"] if name == "trixie" else [], "sid"
    if SYSTEMS[name] == UBUNTU:
        with tarfile.open(base_system("trixie", cache)) as debian, (cache / "ubuntu-keys.gpg").open("wb") as keys:
            shutil.copyfileobj(debian.extractfile(UBUNTU_KEYS), keys)  # type: ignore[arg-type]
        options, script = ["--components=main,universe", f"--keyring={keys.name}"], "gutsy"
    place = f"/usr/share/debootstrap/scripts/{script}"
    with (cache / f"{name}.log").open("w") as log:
        words = ["debootstrap", "--variant=minbase", *options, name, str(folder), SYSTEMS[name], place]
        subprocess.run(words, check=True, stdout=log, stderr=log)
    subprocess.run(["tar", "-C", folder, f"--exclude=./{DOWNLOADED}/*.deb", "-cf", f"{archive}.part", "."], check=True)
    Path(f"{archive}.part").rename(archive)
    shutil.rmtree(folder)
    return archive


@dataclass(frozen=True)
class CleanSystem:
    """A system in a folder. Its programs use the display of this machine; mounts live as long as each program.

    cache: folder where downloaded packages are kept.
    """

    name: str
    folder: Path
    cache: Path
    display: str = ""

    def unpack(self) -> CleanSystem:
        """Unpack the system, add its users and a folder of photos that everybody may write to."""
        subprocess.run(["tar", "-C", self.folder, "-xpf", base_system(self.name, self.cache)], check=True)
        self.photos.mkdir()
        self.photos.chmod(0o777)
        self.run("useradd", "--create-home", "--uid", str(USERS["ann"]), "ann")
        self.run("useradd", "--no-create-home", "--home-dir", "/nonexistent", "--uid", str(USERS["bob"]), "bob")
        return self

    @property
    def photos(self) -> Path:
        """Folder of photos, as this machine sees it; the system sees it as /photos."""
        return self.folder / "photos"

    def run(self, *words: str, user: str = "root", code: int = 0) -> str:
        """Run a program; return its output and messages. Raises AssertionError where it ends with another code."""
        done = subprocess.run(self._words(words, user), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert done.returncode == code, f"{' '.join(words)} ended with {done.returncode}: {done.stdout[-3000:]}"
        return done.stdout

    def start(self, *words: str, user: str) -> subprocess.Popen[bytes]:
        """Start a program."""
        return subprocess.Popen(self._words(words, user))

    def install(self, *packages: str) -> None:
        """Install packages, files among them, with what they need but not what they recommend: a desktop has that."""
        files = [shutil.copy(package, self.folder / "tmp") for package in packages if "/" in package]
        names = [f"/tmp/{Path(file).name}" for file in files] + [name for name in packages if "/" not in name]
        self.run("apt-get", "update", "-qq")
        self.run("apt-get", "install", "-y", "-qq", "--no-install-recommends", *names)

    def _words(self, words: tuple[str, ...], user: str) -> list[str]:
        archives = self.cache / f"{self.name}-packages"
        (archives / "partial").mkdir(parents=True, exist_ok=True)
        mounts = [
            "--bind",
            str(self.folder),
            "/",
            "--dev",
            "/dev",
            "--proc",
            "/proc",
            "--perms",
            "1777",
            "--tmpfs",
            "/dev/shm",
        ]
        mounts += ["--bind", "/tmp/.X11-unix", "/tmp/.X11-unix", "--bind", str(archives), f"/{DOWNLOADED}"]
        mounts += ["--ro-bind", "/etc/resolv.conf", "/etc/resolv.conf"]
        home = {"root": "/root", "ann": "/home/ann", "bob": "/nonexistent"}[user]
        environment = {"HOME": home, "PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LANG": "C.UTF-8", "USER": user}
        environment |= {"DISPLAY": self.display, "DEBIAN_FRONTEND": "noninteractive", "LP_NUM_THREADS": "0"}
        if user != "root":  # root's packages bring certificates
            mounts += ["--ro-bind", "/etc/ssl/certs", "/etc/ssl/certs"]
            environment["SSL_CERT_FILE"] = "/etc/ssl/certs/ca-certificates.crt"
        sets = [word for name, value in environment.items() for word in ("--setenv", name, value)]
        number = str(USERS[user])
        become = ["setpriv", f"--reuid={number}", f"--regid={number}", "--clear-groups"] if user != "root" else []
        limits = ["--die-with-parent", "--cap-add", "ALL", "--chdir", "/photos"]
        return ["bwrap", "--clearenv", *mounts, *sets, *limits, *become, *words]
