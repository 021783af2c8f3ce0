"""The wheel, installed with and without ROS."""

from __future__ import annotations

import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

from composer.bridges.export.container_image import wheel as composer_wheel
from tests.packaging.installation import Installation, with_this_ros, without_ros


def test_the_wheel_contains_all_shared_files_and_no_others(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()

    for path in (
        "composer/py.typed",
        "composer/python_code/stubs/libraries/rclpy/node.pyi",
        "composer/share/interfaces/action/Navigate.action",
        "composer/share/nodes/planner.py",
        "composer/share/nodes/planner.yaml",
        "composer/share/rules/RC311.md",
        "composer/share/schemas/system.schema.json",
        "composer/share/systems/pipeline.yaml",
        "composer/graph/formats/html/main.js",
        "composer/graph/formats/html/page.css",
        "composer/dashboard/page/index.html",
        "composer/dashboard/page/views/graph.js",
        "composer/dashboard/page/vendor/uplot/uPlot.esm.js",
    ):
        assert path in names
    assert [name for name in names if name.endswith("/licenses/LICENSE")]
    assert [name for name in names if name.endswith("/licenses/THIRD_PARTY.md")]
    assert [
        name for name in names if name.endswith("vendor/uplot/LICENSE") and "/licenses/" in name
    ]
    assert [name for name in names if "__pycache__" in name or name.startswith("tests/")] == []


def test_the_wheel_of_images_is_the_same(wheel: Path, tmp_path: Path) -> None:
    """That of ``compose export docker-compose``, made of the files of an installation."""
    name, data = composer_wheel("ros2-composer")
    (tmp_path / name).write_bytes(data)
    built, packed = zipfile.ZipFile(wheel), zipfile.ZipFile(tmp_path / name)
    assert name == wheel.name
    assert sorted(packed.namelist()) == sorted(built.namelist())
    for path in built.namelist():
        if path.startswith("composer/"):
            assert packed.read(path) == built.read(path), path


def test_the_command_prints_its_version(installation: Installation) -> None:
    done = installation.run("compose", "--version", variables=without_ros())

    assert done.returncode == 0, done.stderr
    assert version("ros2-composer") in done.stdout


def test_the_empty_environment_has_no_ros(installation: Installation) -> None:
    done = installation.run("python", "-c", "import rclpy", variables=without_ros())

    assert "No module named 'rclpy'" in done.stderr


def test_the_shipped_files_are_valid_from_another_folder_and_without_ros(
    installation: Installation,
) -> None:
    share = installation.package / "share"

    done = installation.run(
        "compose", "validate", share / "systems", share / "nodes", variables=without_ros()
    )

    assert done.returncode == 0, done.stdout + done.stderr


def test_an_error_is_reported_without_ros(installation: Installation) -> None:
    broken = installation.elsewhere / "broken.yaml"
    broken.write_text("system: broken\nnodes:\n  planner: {type: planer}\n", "utf-8")

    done = installation.run("compose", "validate", broken.name, variables=without_ros())

    assert done.returncode == 1
    assert "did you mean 'planner'?" in done.stdout + done.stderr


def test_a_diagram_is_drawn_without_ros(installation: Installation) -> None:
    system = installation.package / "share" / "systems" / "pipeline.yaml"

    done = installation.run("compose", "graph", system, variables=without_ros())

    assert done.returncode == 0, done.stderr
    assert "motor_controller" in done.stdout


@pytest.mark.ros
@pytest.mark.parametrize("name", ["talker_listener", "pipeline"])
def test_a_shipped_system_runs_with_ros(installation: Installation, name: str) -> None:
    system = installation.package / "share" / "systems" / f"{name}.yaml"

    done = installation.run("compose", "run", system, "--for", "2", variables=with_this_ros())

    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr


@pytest.mark.ros
def test_the_installed_package_is_imported(installation: Installation) -> None:
    where = "import composer, rclpy; print(composer.__file__)"

    done = installation.run("python", "-c", where, variables=with_this_ros())

    assert Path(done.stdout.strip()).is_relative_to(installation.package), done.stderr
