"""The ament package lists its files by hand, in a place that is easily forgotten."""

from __future__ import annotations

import re
import tomllib
from xml.etree import ElementTree

from composer.base.resources import interfaces_folder

FOLDER = interfaces_folder()


def test_every_interface_is_listed_for_the_generators() -> None:
    listed = re.findall(
        r'"(\w+/\w+\.(?:msg|srv|action))"', (FOLDER / "CMakeLists.txt").read_text("utf-8")
    )
    files = [
        path.relative_to(FOLDER).as_posix()
        for kind in ("msg", "srv", "action")
        for path in FOLDER.glob(f"*/*.{kind}")
    ]

    assert sorted(listed) == sorted(files)


def test_ament_and_pip_have_the_same_name_and_version() -> None:
    package = ElementTree.parse(FOLDER / "package.xml").getroot()
    project = tomllib.loads((FOLDER / "pyproject.toml").read_text("utf-8"))["project"]

    assert package.findtext("name") == project["name"].replace("-", "_")
    assert package.findtext("version") == project["version"]


def test_every_ros_wheel_of_the_build_is_pinned() -> None:
    build = tomllib.loads((FOLDER / "pyproject.toml").read_text("utf-8"))["build-system"]
    wheels = [requirement for requirement in build["requires"] if requirement.startswith("ros-")]

    assert wheels
    assert [wheel for wheel in wheels if "==" not in wheel] == []
