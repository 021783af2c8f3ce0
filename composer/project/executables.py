"""Where the executables of ROS and Python packages are, as ``ros2 run`` finds them.

In each prefix of AMENT_PREFIX_PATH whose index has the package, ``lib/<package>/<name>``. Where ROS
comes from PyPI, the prefix is that of Python. pip installs the scripts of Python packages in
``bin``; they are found among the package's ``console_scripts``.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from composer.base.folders import ament_prefixes

if TYPE_CHECKING:
    from importlib.metadata import Distribution

_RESOURCES = Path("share", "ament_index", "resource_index")
_INDEX = _RESOURCES / "packages"
_COMPONENTS = _RESOURCES / "rclcpp_components"
_RUN = "import sys; from {module} import {function} as main; sys.exit(main())"


def has_ros_packages(environment: Mapping[str, str]) -> bool:
    """Return whether any ROS package is installed. Without ROS, a missing one says nothing."""
    return any((prefix / _INDEX).is_dir() for prefix in ament_prefixes(environment))


def has_package(package: str, environment: Mapping[str, str]) -> bool:
    """Return whether a ROS or Python package is installed."""
    return any(_libraries(package, environment)) or _distribution(package) is not None


def executable_names(package: str, environment: Mapping[str, str]) -> tuple[str, ...]:
    """Return the names of the executables of a package, sorted."""
    names = {
        path.name
        for folder in _libraries(package, environment)
        if folder.is_dir()
        for path in folder.iterdir()
        if _is_executable(path)
    }
    found = _distribution(package)
    if found is not None:
        names.update(script.name for script in found.entry_points.select(group="console_scripts"))
    return tuple(sorted(names))


def find_executable(
    package: str, name: str, environment: Mapping[str, str]
) -> tuple[str, ...] | None:
    """Return the first words of the command that runs an executable; None if there is none."""
    for folder in _libraries(package, environment):
        path = folder / name
        if path.parent == folder and _is_executable(path):
            return (str(path),)
    found = _distribution(package)
    scripts = () if found is None else found.entry_points.select(group="console_scripts", name=name)
    for script in scripts:
        code = _RUN.format(module=script.module, function=script.attr.partition(".")[0])
        return (sys.executable, "-c", code)
    return None


def component_plugins(package: str, environment: Mapping[str, str]) -> tuple[str, ...] | None:
    """Return the classes that a package registers as components; None if it registers none."""
    if not package or "/" in package:
        return None
    for prefix in ament_prefixes(environment):
        path = prefix / _COMPONENTS / package
        if path.is_file():
            lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
            return tuple(line.partition(";")[0].strip() for line in lines if ";" in line)
    return None


def find_program(program: str, folder: Path, environment: Mapping[str, str]) -> str | None:
    """Return the path of the first word of a command; None if there is no such program.

    A path is relative to ``folder``, a name is looked up in PATH.
    """
    if "/" in program:
        path = folder / Path(program).expanduser()
        return str(path.absolute()) if _is_executable(path) else None
    return shutil.which(program, path=program_path(environment))


def program_path(environment: Mapping[str, str]) -> str:
    """Return PATH, with the programs of this Python's environment first, as if it was activated."""
    own = str(Path(sys.executable).parent)
    folders = environment.get("PATH", os.defpath).split(os.pathsep)
    return os.pathsep.join(folders if own in folders else [own, *folders])


def _libraries(package: str, environment: Mapping[str, str]) -> Iterator[Path]:
    """Yield the folders of a ROS package's executables, which may not exist."""
    if not package or "/" in package:
        return
    for prefix in ament_prefixes(environment):
        if (prefix / _INDEX / package).is_file():
            yield prefix / "lib" / package


def _distribution(package: str) -> Distribution | None:
    from importlib.metadata import PackageNotFoundError, distribution  # noqa: PLC0415 (slow)

    for name in (package, f"ros-{package}"):
        try:
            return distribution(name.replace("_", "-"))
        except (PackageNotFoundError, ValueError):
            continue
    return None


def _is_executable(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)
