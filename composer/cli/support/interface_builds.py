"""Build interface packages with pip or colcon."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.metadata import distributions
from pathlib import Path

from composer.bridges.scaffolding.interface_package import (
    InvalidPackage,
    NotForPip,
    bundled_package,
    read_package,
)
from composer.cli.support.errors import CommandError
from composer.cli.support.output.terminal import say

_WHEEL_PREFIX = "ros-"


def wheel_versions() -> dict[str, str]:
    """Return the versions of the ROS packages that pip has installed, by their ROS names."""
    found = {}
    for item in distributions():
        name = item.metadata["Name"] or ""
        if name.startswith(_WHEEL_PREFIX):
            found[name.removeprefix(_WHEEL_PREFIX).replace("-", "_")] = item.version
    return found


def complete_package(name: str, folder: Path | None, target: Path, *, for_pip: bool = True) -> None:
    """Write the complete package to ``target``, which is replaced as a whole. Raises CommandError.

    Without a folder, it is a package of ROS whose definitions come with the composer. Unless it has
    to be built with pip, what pip needs may be left out.
    """
    try:
        package = bundled_package(name) if folder is None else read_package(name, folder)
        try:
            files = package.files(wheel_versions())
        except NotForPip as error:
            if for_pip:
                hint = f"build it with colcon: compose interface build {name} --generate FOLDER"
                raise CommandError(str(error), hint=hint) from error
            files = package.files(None)
        _replace_folder(target, files)
    except InvalidPackage as error:
        raise CommandError(str(error)) from error
    except (OSError, UnicodeDecodeError) as error:
        raise CommandError(f"cannot complete package '{name}': {error}") from error


def _replace_folder(target: Path, files: Mapping[str, str]) -> None:
    """Write files to a folder, which is as before if that fails. Raises OSError."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.name}.") as temporary:
        new, old = Path(temporary, "new"), Path(temporary, "old")
        new.mkdir()
        for path, text in files.items():
            file = new / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        if target.exists():
            target.rename(old)
        try:
            new.rename(target)
        except OSError:
            if old.exists():
                old.rename(target)
            raise


def install_package(name: str, folder: Path) -> None:
    """Build a complete package with pip, and install it for this Python. Raises CommandError."""
    if "rclpy" not in wheel_versions():
        raise CommandError(
            "pip can build interfaces only where ROS 2 is installed from PyPI",
            hint=f"colcon build --base-paths {folder}",
        )
    say(f"building {name}, which takes up to a minute")
    done = subprocess.run(  # noqa: S603 - this very Python
        [
            sys.executable,
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-deps",
            "--force-reinstall",
            folder,
        ],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode != 0:
        say(done.stdout + done.stderr)
        raise CommandError(f"package '{name}' was not built", hint="see the output of pip above")
