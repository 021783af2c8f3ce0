"""Create the virtual environment that `make` works in, on a machine that may lack half of Python.

    python3 tools/create_environment.py .venv

Uses the standard library only and runs on old Pythons as well, to be able to say that they are too
old. What is missing is said in one sentence on stderr, with exit code 1, before time is spent.
"""

import importlib.util
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import urllib.parse
import urllib.request
import venv
from pathlib import Path

OLDEST_PYTHON = (3, 11)
NEWEST_PYTHON = (3, 14)  # the newest that ROS 2 Jazzy's wheels on PyPI are built for
TIMEOUT_S = 60


def _version_text(version):
    return ".".join(str(number) for number in version[:2])


def python_problem(version, available):
    """Return why a Python of this version will not do, or None.

    `available` are the versions that could be taken instead.
    """
    if OLDEST_PYTHON <= tuple(version[:2]) <= NEWEST_PYTHON:
        return None
    wanted = f"{_version_text(OLDEST_PYTHON)} to {_version_text(NEWEST_PYTHON)}"
    if available:
        remedy = f"run: make PYTHON=python{_version_text(available[0])}"
    else:
        remedy = "install one and run: make PYTHON=/path/to/python"
    return f"this is Python {_version_text(version)}, and Python {wanted} is needed; {remedy}"


def platform_problem(system, machine):
    """Return why ROS wheels cannot be had on this platform, or None."""
    if (system, machine) == ("Linux", "x86_64"):
        return None
    return (
        f"ROS 2 wheels exist for Linux x86_64, not for {system} {machine}; "
        "README.md says how to use a ROS 2 of your own"
    )


def compiler_problem(has_compiler, has_headers, python_name):
    """Return what is missing to compile the interfaces, as the command that brings it, or None."""
    packages = []
    if not has_compiler:
        packages.append("g++")
    if not has_headers:
        packages.append(f"{python_name}-dev")
    if not packages:
        return None
    return f"what compiles the interfaces is missing; run: sudo apt install {' '.join(packages)}"


def _available_pythons():
    """Return the versions on the PATH that would do, newest last, as far as they start."""
    found = []
    for minor in range(OLDEST_PYTHON[1], NEWEST_PYTHON[1] + 1):
        command = shutil.which(f"python3.{minor}")
        if command and subprocess.call([command, "-c", ""], stderr=subprocess.DEVNULL) == 0:
            found.append((3, minor))
    return found


def _has_compiler():
    return all(shutil.which(command) for command in ("gcc", "g++"))


def _has_headers():
    return (Path(sysconfig.get_path("include")) / "Python.h").is_file()


def find_problem():
    """Return the first thing that keeps this machine from building and running, or None."""
    name = Path(sys.executable).name
    return (
        platform_problem(platform.system(), platform.machine())
        or python_problem(sys.version_info, _available_pythons())
        or compiler_problem(_has_compiler(), _has_headers(), name)
    )


def newest_wheel(page):
    """Return the link to the newest finished wheel of pip on a page of a package index (PEP 503).

    Raises ValueError when there is none.
    """
    links = re.findall(r'href="([^"]*/pip-([\d.]+)-py3-none-any\.whl)[#"]', page)
    if not links:
        raise ValueError("the package index names no wheel of pip")
    return max(links, key=lambda link: [int(number) for number in link[1].split(".")])[0]


def _download_pip(folder):
    """Fetch pip's newest wheel from the package index and return where it lies."""
    index = os.environ.get("PIP_INDEX_URL", "https://pypi.org/simple").rstrip("/") + "/pip/"
    with urllib.request.urlopen(index, timeout=TIMEOUT_S) as answer:
        link = urllib.parse.urljoin(index, newest_wheel(answer.read().decode()))
    target = folder / link.rpartition("/")[2]
    with urllib.request.urlopen(link, timeout=TIMEOUT_S) as answer:
        target.write_bytes(answer.read())
    return target


def _install_pip(python):
    """Put pip into an environment that was made without, as Debian's Python makes them."""
    with tempfile.TemporaryDirectory() as folder:
        wheel = _download_pip(Path(folder))
        # A wheel of pip is a zip file that Python can run.
        command = [str(python), str(wheel / "pip"), "install", "--quiet", str(wheel)]
        subprocess.run(command, check=True)


def create(folder):
    """Create the environment with pip in it. Raises OSError, ValueError or CalledProcessError."""
    has_ensurepip = importlib.util.find_spec("ensurepip") is not None
    venv.create(folder, clear=True, symlinks=True, with_pip=has_ensurepip)
    if not has_ensurepip:
        _install_pip(Path(folder) / "bin" / "python")


def main():
    """Create the environment named on the command line; return the exit code."""
    problem = find_problem()
    if problem:
        print(problem, file=sys.stderr)
        return 1
    try:
        create(sys.argv[1])
    except (OSError, ValueError, subprocess.CalledProcessError) as error:
        print(
            f"the environment could not be created ({error}); "
            "on Debian and Ubuntu this helps: sudo apt install python3-venv",
            file=sys.stderr,
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
