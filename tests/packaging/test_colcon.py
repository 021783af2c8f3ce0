"""colcon from PyPI builds the composer and a project; pip builds an interface package."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest
import typer

from tests.packaging.conftest import ROOT
from tests.packaging.installation import Installation, with_this_ros, without_ros

pytestmark = [pytest.mark.soak, pytest.mark.timeout(600)]


def run(*command: str | Path, folder: Path, variables: dict[str, str]) -> str:
    done = subprocess.run(
        list(map(str, command)),
        cwd=folder,
        env=variables,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.mark.parametrize("options", [(), ("--symlink-install",)])
def test_colcon_builds_the_composer_and_a_project(
    options: tuple[str, ...], tmp_path: Path, installation: Installation
) -> None:
    environment = tmp_path / "environment"
    venv.create(environment, with_pip=True, symlinks=True)
    python = environment / "bin" / "python"
    pip = (python, "-m", "pip", "install", "-qq", "colcon-common-extensions", "setuptools<80")
    run(*pip, folder=tmp_path, variables=without_ros())
    sources = tmp_path / "ws" / "src"
    for name in ("composer", "docs/rules", "interfaces", "nodes", "resource", "schemas", "systems"):
        shutil.copytree(ROOT / name, sources / "ros2_composer" / name)
    for name in ("package.xml", "pyproject.toml", "setup.py"):
        shutil.copy(ROOT / name, sources / "ros2_composer")
    compose = installation.environment / "bin" / "compose"
    run(compose, "new", "project", "my_robot", folder=sources, variables=without_ros())
    variables = without_ros()
    variables["PATH"] = f"{environment / 'bin'}{os.pathsep}{variables['PATH']}"
    output = run(
        environment / "bin" / "colcon",
        "build",
        *options,
        folder=tmp_path / "ws",
        variables=variables,
    )
    assert "2 packages finished" in output
    assert "doesn't explicitly" not in output
    script = ". ws/install/setup.sh && compose run my_robot/my_robot --dry-run"
    shown = run("sh", "-c", script, folder=tmp_path, variables=variables | {"PYTHONPATH": _site()})
    assert "activate /listener" in shown


def test_an_interface_package_is_built(installation: Installation, tmp_path: Path) -> None:
    compose = installation.environment / "bin" / "compose"
    run(compose, "new", "project", "my_robot", folder=tmp_path, variables=without_ros())
    project = tmp_path / "my_robot"
    run(compose, "new", "interfaces", "my_msgs", folder=project, variables=without_ros())
    target = project / "generated"
    command = (sys.executable, "-P", "-m", "composer", "interface", "build", "my_msgs")
    run(*command, "--generate", target, folder=project, variables=with_this_ros())
    wheels = tmp_path / "wheels"
    pip = (sys.executable, "-m", "pip", "wheel", "-qq", "--no-deps", "--wheel-dir", wheels)
    run(*pip, target, folder=tmp_path, variables=without_ros())
    (wheel,) = wheels.glob("my_msgs-*.whl")
    names = run(
        sys.executable, "-m", "zipfile", "-l", wheel, folder=tmp_path, variables=without_ros()
    )
    assert "my_msgs/msg/_status.py" in names
    assert "share/my_msgs/msg/Status.json" in names


def _site() -> str:
    """Return the folder with the dependencies of the composer."""
    return str(Path(typer.__file__).parents[1])
