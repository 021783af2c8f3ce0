"""Create the virtual environment that `make` works in, on a machine that may lack half of Python.

    python3 tools/create_environment.py .venv

Uses the standard library only and runs on old Pythons as well, to be able to say that they are too
old. What is missing is said in one sentence on stderr, with exit code 1, before time is spent.
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
NEWEST_PYTHON = (3, 14)  # the newest that ROS 2 Jazzy's wheels on PyPI are built for


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
        remedy = f"run: make run PYTHON=python{_version_text(available[0])}"
    else:
        remedy = "install one and run: make run PYTHON=/path/to/python"
    return f"this is Python {_version_text(version)}, and Python {wanted} is needed; {remedy}"


def platform_problem(system, machine):
    """Return why ROS wheels cannot be had on this platform, or None."""
    if (system, machine) == ("Linux", "x86_64"):
        return None
    return (
        f"ROS 2 wheels exist for Linux x86_64, not for {system} {machine}; "
        "README.md says how to use a ROS 2 of your own"
    )


def compiler_problem(has_compiler):
    """Return how to get what compiles the interfaces, or None where it is."""
    return None if has_compiler else "there is no C++ compiler; run: sudo apt install g++"


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
    return (
        platform_problem(platform.system(), platform.machine())
        or python_problem(sys.version_info, _available_pythons())
        or compiler_problem(_has_compiler())
    )


def _unpack_package(package, folder):
    """Unpack a package of Debian or Ubuntu into ``folder``, without installing it.

    Raises OSError or CalledProcessError.
    """
    folder.mkdir(exist_ok=True)
    download = ["apt-get", "download", "-qq", package]
    subprocess.run(download, cwd=folder, check=True, stderr=subprocess.DEVNULL)
    (archive,) = folder.glob("*.deb")
    subprocess.run(["dpkg-deb", "--extract", archive.name, "."], cwd=folder, check=True)
    archive.unlink()


def _install_pip(python):
    """Put pip into an environment that was made without, as Debian's Python makes them."""
    with tempfile.TemporaryDirectory() as folder:
        _unpack_package("python3-pip-whl", Path(folder))
        wheel = next(Path(folder).glob("usr/share/python-wheels/pip-*.whl"))
        # A wheel of pip is a zip file that Python can run.
        command = [str(python), str(wheel / "pip"), "install", "--quiet", str(wheel)]
        subprocess.run(command, check=True)


def create(folder):
    """Create the environment with pip in it. Raises OSError or CalledProcessError."""
    has_ensurepip = importlib.util.find_spec("ensurepip") is not None
    venv.create(folder, clear=True, symlinks=True, with_pip=has_ensurepip)
    if not has_ensurepip:
        _install_pip(folder / "bin" / "python")


def fetch_headers(folder):
    """Unpack Python's headers, as Debian and Ubuntu package them, without installing them.

    Raises OSError or CalledProcessError.
    """
    _unpack_package(f"libpython{_version_text(sys.version_info)}-dev", folder)


def _attempt(step, folder, purpose, package):
    """Take a step; return why it failed and which package of the system makes up for it."""
    try:
        step(folder)
    except (OSError, subprocess.CalledProcessError) as error:
        return f"{purpose} failed ({error}); run: sudo apt install {package}"
    return None


def main(folder):
    """Create the environment, print what is in the way, and return the exit code."""
    problem = find_problem() or _attempt(create, folder, "creating the environment", "python3-venv")
    if problem is None and not _has_headers():
        package = f"{Path(sys.executable).name}-dev"
        problem = _attempt(fetch_headers, folder / "headers", "fetching Python's headers", package)
    if problem:
        print(problem, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
