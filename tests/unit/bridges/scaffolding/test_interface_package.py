"""Interface packages that are completed from their definitions."""

from __future__ import annotations

import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from composer.bridges.scaffolding import InvalidPackage, bundled_package, read_package
from tests.unit.support.checking import write_files

VERSIONS = {"builtin_interfaces": "2.0.3", "geometry_msgs": "5.3.6"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    definitions = {
        "msg/Status.msg": "builtin_interfaces/Time since\nLevel[] levels\n",
        "msg/Level.msg": "float64 value\n",
        "srv/Move.srv": "geometry_msgs/Pose goal\n---\nbool success\n",
        "action/Drive.action": "float64 m\n---\n---\nfloat64 left\n",
        "msg/notes.txt": "not an interface\n",
    }
    write_files(tmp_path, definitions)
    return tmp_path


def test_the_dependencies_are_those_of_the_fields(folder: Path) -> None:
    package = read_package("robot_msgs", folder)
    names = ("action_msgs", "builtin_interfaces", "geometry_msgs", "service_msgs")
    assert package.dependencies == names
    definitions = ["msg/Level.msg", "msg/Status.msg", "srv/Move.srv", "action/Drive.action"]
    assert list(package.definitions) == definitions
    files = package.files(VERSIONS)
    manifest = ElementTree.fromstring(files["package.xml"])
    assert manifest.findtext("name") == "robot_msgs"
    assert [item.text for item in manifest.findall("depend")] == list(package.dependencies)
    assert '  "srv/Move.srv"\n' in files["CMakeLists.txt"]
    assert "DEPENDENCIES action_msgs builtin_interfaces geometry_msgs" in files["CMakeLists.txt"]
    project = tomllib.loads(files["pyproject.toml"])
    assert project["project"]["name"] == "robot-msgs"
    requires = project["build-system"]["requires"]
    assert {"ros-builtin-interfaces==2.0.3", "ros-geometry-msgs==5.3.6"} <= {*requires}
    assert not [item for item in requires if item.startswith("ros-nav-msgs")]
    assert len([item for item in requires if item.startswith("ros-action-msgs")]) == 1


def test_what_cannot_be_built_is_explained(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidPackage, match="'robot_msgs' uses types of 'geometry_msgs', which"):
        read_package("robot_msgs", folder).files({"builtin_interfaces": "2.0.3"})
    (folder / "msg" / "Bad.msg").write_text("float64\n")
    with pytest.raises(InvalidPackage, match=r"Bad\.msg:1: "):
        read_package("robot_msgs", folder)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InvalidPackage, match=r"has no \.msg, \.srv or \.action file"):
        read_package("robot_msgs", tmp_path / "empty")


def test_packages_of_ros_come_with_the_composer() -> None:
    package = bundled_package("tf2_msgs")
    assert (
        package.definitions["msg/TFMessage.msg"] == "geometry_msgs/TransformStamped[] transforms\n"
    )
    assert set(package.definitions) == {
        "msg/TF2Error.msg",
        "msg/TFMessage.msg",
        "srv/FrameGraph.srv",
        "action/LookupTransform.action",
    }
    assert "geometry_msgs" in package.dependencies
