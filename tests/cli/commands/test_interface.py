from __future__ import annotations

import json
from pathlib import Path

import pytest

from composer.cli.commands import interface
from tests.cli.compose import compose, refused, write_files


def test_nested_messages_are_expanded_without_their_comments() -> None:
    show = ("interface", "show", "geometry_msgs/msg/PointStamped")
    done = compose(*show, "--no-comments")
    assert done.code == 0
    assert done.out.splitlines() == [
        "std_msgs/Header header",
        "\tbuiltin_interfaces/Time stamp",
        "\t\tint32 sec",
        "\t\tuint32 nanosec",
        "\tstring frame_id",
        "Point point",
        "\tfloat64 x",
        "\tfloat64 y",
        "\tfloat64 z",
    ]
    pytest.importorskip("geometry_msgs", reason="the definitions without ROS have no comments")
    assert "# " in compose(*show).out


def test_the_types_of_a_package_are_listed() -> None:
    everything = compose("interface", "list").out.split()
    assert {"std_msgs/msg/String", "std_srvs/srv/Trigger"} <= set(everything)
    types = ["composer_interfaces/srv/PlanTrajectory", "composer_interfaces/action/Navigate"]
    assert compose("interface", "list", "composer_interfaces").out.split() == types
    assert json.loads(compose("interface", "list", "composer_interfaces", "--json").out) == types


def test_services_actions_and_constants_are_shown() -> None:
    show = ("interface", "show", "std_srvs/srv/SetBool")
    assert compose(*show, "--no-comments").out == "bool data\n---\nbool success\nstring message\n"
    shown = json.loads(compose(*show, "--json").out)
    assert shown["name"] == "std_srvs/srv/SetBool"
    assert shown["request"]["fields"] == [{"name": "data", "type": "bool", "default": None}]
    action = compose("interface", "show", "composer_interfaces/action/Navigate").out
    assert action.count("---\n") == 2
    show = ("interface", "show", "rcl_interfaces/msg/Log")
    assert "uint8 DEBUG=10" in compose(*show).out
    log = json.loads(compose(*show, "--json").out)
    assert {"name": "DEBUG", "type": "uint8", "value": 10} in log["message"]["constants"]


def test_an_unknown_name_gets_a_suggestion() -> None:
    hint = "did you mean 'std_msgs/msg/String'?"
    assert hint in refused(1, "interface", "show", "std_msgs/msg/Sting")
    assert "did you mean 'std_msgs'?" in refused(1, "interface", "list", "std_msg")


def test_packages_for_colcon_need_no_wheels(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pip has not installed ROS 2 there."""
    monkeypatch.setattr(interface, "wheel_versions", dict)
    assert compose("new", "interfaces", "my_msgs").code == 0
    status = folder / "interfaces" / "my_msgs" / "msg" / "Status.msg"
    status.write_text("geometry_msgs/Pose pose\n")
    message = refused(1, "interface", "build")
    assert "uses types of 'geometry_msgs', which pip has not installed" in message
    assert "compose interface build my_msgs --generate FOLDER" in message
    done = compose("interface", "build", "my_msgs", "--generate", "generated")
    assert (done.code, done.out) == (0, "my_msgs: generated\n")
    assert (folder / "generated" / "CMakeLists.txt").is_file()
    assert not (folder / "generated" / "pyproject.toml").exists()
    done = compose("interface", "build", "my_msgs", "--generate", "generated")
    assert "'generated' exists already" in done.err
    status.write_text("strng text\n")
    done = compose("interface", "build")
    assert "'strng' is neither a primitive type nor a message" in done.err
    assert "Status.msg:1:1\n" in done.err


def test_definitions_are_checked_before_anything_is_built(folder: Path) -> None:
    write_files({"composer.yaml": "interfaces: [interfaces]\n"})
    for name, definition in (("my_msgs", "Header header"), ("good_msgs", "float32 speed")):
        package = f"<package><name>{name}</name></package>\n"
        files = {"package.xml": package, "msg/Speed.msg": f"{definition}\n"}
        write_files(files, folder / "interfaces" / name)
    message = refused(1, "interface", "build")
    assert "interfaces/my_msgs/msg/Speed.msg:1:1\n" in message
    assert "did you mean 'std_msgs/Header'?" in message
    assert not Path("build").exists()
    done = compose("interface", "build", "good_msgs", "--generate", "complete")
    assert (done.code, done.out) == (0, "good_msgs: complete\n")
