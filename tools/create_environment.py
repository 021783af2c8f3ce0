"""Create the virtual environment for `make`, even if parts of Python are not installed.

    python3 tools/create_environment.py .venv

Uses the standard library only and runs on old Python versions, to be able to report them. If a
requirement is missing, prints a message on stderr and exits with status 1.
"""

import importlib.util
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import venv
from pathlib import Path

OLDEST_PYTHON = (3, 11)
NEWEST_PYTHON = (3, 14)  # the newest version with ROS 2 Jazzy wheels on PyPI


def _version_text(version):
    return ".".join(str(number) for number in version[:2])


def python_problem(version, available):
    """Return why this Python version is not supported, or None.

    `available` are supported versions that are installed.
    """
    if OLDEST_PYTHON <= tuple(version[:2]) <= NEWEST_PYTHON:
        return None
    supported = f"{_version_text(OLDEST_PYTHON)} to {_version_text(NEWEST_PYTHON)}"
    if available:
        fix = f"run: make run PYTHON=python{_version_text(available[0])}"
    else:
        fix = "install one and run: make run PYTHON=/path/to/python"
    return f"Python {supported} is required, but this is Python {_version_text(version)}; {fix}"


def platform_problem(system, machine):
    """Return why ROS wheels are not available for this platform, or None."""
    if (system, machine) == ("Linux", "x86_64"):
        return None
    return (
        f"ROS 2 wheels are available for Linux x86_64, not for {system} {machine}; "
        "see README.md for how to use an existing ROS 2 installation"
    )


def compiler_problem(has_compiler):
    """Return how to install a compiler for the interfaces, or None if there is one."""
    return None if has_compiler else "C++ compiler not found; run: sudo apt install g++"


def _available_pythons():
    """Return the supported versions on the PATH that work, newest last."""
    versions = []
    for minor in range(OLDEST_PYTHON[1], NEWEST_PYTHON[1] + 1):
        command = shutil.which(f"python3.{minor}")
        if command and subprocess.call([command, "-c", ""], stderr=subprocess.DEVNULL) == 0:
            versions.append((3, minor))
    return versions


def _has_compiler():
    return all(shutil.which(command) for command in ("gcc", "g++"))


def _has_headers():
    return (Path(sysconfig.get_path("include")) / "Python.h").is_file()


def find_problem():
    """Return the first missing requirement of this machine, or None."""
    return (
        platform_problem(platform.system(), platform.machine())
        or python_problem(sys.version_info, _available_pythons())
        or compiler_problem(_has_compiler())
    )


def _unpack_package(package, folder):
    """Unpack a Debian or Ubuntu package into ``folder``, without installing it.

    Raises OSError or CalledProcessError.
    """
    folder.mkdir(exist_ok=True)
    download = ["apt-get", "download", "-qq", package]
    subprocess.run(download, cwd=folder, check=True, stderr=subprocess.DEVNULL)
    (archive,) = folder.glob("*.deb")
    subprocess.run(["dpkg-deb", "--extract", archive.name, "."], cwd=folder, check=True)
    archive.unlink()


def _install_pip(python):
    """Install pip into an environment without it, as created by the Python of Debian."""
    with tempfile.TemporaryDirectory() as folder:
        _unpack_package("python3-pip-whl", Path(folder))
        wheel = next(Path(folder).glob("usr/share/python-wheels/pip-*.whl"))
        # Python can run pip directly from its wheel, which is a zip file.
        command = [str(python), str(wheel / "pip"), "install", "--quiet", str(wheel)]
        subprocess.run(command, check=True)


def create(folder):
    """Create the environment with pip. Raises OSError or CalledProcessError."""
    has_ensurepip = importlib.util.find_spec("ensurepip") is not None
    venv.create(folder, clear=True, symlinks=True, with_pip=has_ensurepip)
    if not has_ensurepip:
        _install_pip(folder / "bin" / "python")


def fetch_headers(folder):
    """Unpack the Python headers of the Debian or Ubuntu package, without installing them.

    Raises OSError or CalledProcessError.
    """
    _unpack_package(f"libpython{_version_text(sys.version_info)}-dev", folder)


def _attempt(step, folder, purpose, package):
    """Run a step; return why it failed and which system package fixes it, or None."""
    try:
        step(folder)
    except (OSError, subprocess.CalledProcessError) as error:
        return f"{purpose} failed ({error}); run: sudo apt install {package}"
    return None


def main(folder):
    """Create the environment and return the exit code."""
    problem = find_problem() or _attempt(create, folder, "creating the environment", "python3-venv")
    if problem is None and not _has_headers():
        package = f"{Path(sys.executable).name}-dev"
        problem = _attempt(
            fetch_headers, folder / "headers", "downloading the Python headers", package
        )
    if problem:
        print(problem, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
