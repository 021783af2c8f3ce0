"""The image that the containers of a system have in common."""

from __future__ import annotations

import json
import shlex
from pathlib import PurePosixPath

from composer.base.fast_dataclass import dataclass
from composer.bridges.templates import filled
from composer.project.copied_files import pattern_of

CONTAINERFILE = PurePosixPath("Containerfile")
#: Where BuildKit and podman look for it first.
IGNORED_FILES = PurePosixPath("Containerfile.dockerignore")
#: In the image. It is the id of the first user of most installations, whose nodes share memory.
USER_ID = 1000
PROJECT = "/project"
WRITABLE = "/tmp"  # noqa: S108  (of the container)
_REQUIREMENTS = """\
COPY requirements.txt .
RUN pip install --no-cache-dir -r requirements.txt

"""
_INTERFACES = """\
RUN apt-get update && apt-get install -y --no-install-recommends g++ \\
    && compose interface build {packages} \\
    && apt-get purge -y --auto-remove g++ && rm -rf /var/lib/apt/lists/* build
"""
_UNKNOWN = """\
# Not in the image, unless requirements.txt adds them: {packages}
"""
_IGNORED = """\
# Written by 'compose export': files of the project that are not copied into the image.
"""


@dataclass(frozen=True, slots=True)
class Contents:
    """What is in the image of a system.

    ``file`` is the file of the system below the root of its project. ``python`` is the version of
    Python (3.12).
    ``has_requirements`` is whether the project has a requirements.txt. ``interfaces`` are interface
    packages to be compiled, ``unknown_interfaces`` those of which there are no definitions here.
    ``ignored`` are the patterns for docker of files that are not in it, first those that hold for
    files made later, then those of files that exist.
    """

    system: str
    file: PurePosixPath
    python: str = "3.12"
    has_requirements: bool = False
    interfaces: tuple[str, ...] = ()
    unknown_interfaces: tuple[str, ...] = ()
    ignored: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())

    @property
    def run(self) -> list[str]:
        """The command that runs the system in the image."""
        return ["compose", "run", str(self.file)]


def containerfile(contents: Contents, wheel: PurePosixPath) -> str:
    """Return the Containerfile, which docker and podman build.

    ``wheel`` is the wheel of the composer below the root of the project.
    """
    return filled(
        "Containerfile",
        system=contents.system,
        python=contents.python,
        wheel=wheel.name,
        copied=json.dumps([str(wheel), f"{WRITABLE}/"]),
        temporary=WRITABLE,
        project=PROJECT,
        requirements=_REQUIREMENTS if contents.has_requirements else "",
        interfaces=_INTERFACES.format(packages=shlex.join(contents.interfaces))
        if contents.interfaces
        else "",
        unknown=_UNKNOWN.format(packages=", ".join(contents.unknown_interfaces))
        if contents.unknown_interfaces
        else "",
        file=shlex.quote(str(contents.file)),
        writable=WRITABLE,
        user=str(USER_ID),
        command=json.dumps(contents.run),
    )


def ignored_files(contents: Contents, wheel: PurePosixPath) -> str:
    """Return the patterns of files that are not copied into the image."""
    general, files = contents.ignored
    folders = {pattern_of(str(path)) for path in wheel.parents}  # may be ignored by git
    first = [line for line in files if line in folders]
    last = [line for line in files if line not in folders]
    lines = (*general, *first, f"!{pattern_of(str(wheel))}", *last)
    return _IGNORED + "".join(f"{line}\n" for line in lines)
