from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
import yaml

from tests.cli.compose import compose


def test_nested_messages_are_expanded() -> None:
    done = compose("interface", "show", "geometry_msgs/msg/PointStamped", "--no-comments")
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


@pytest.fixture
def commented(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A project with the nested message ``parts/msg/Outer``, which has comments."""
    folder = tmp_path / "interfaces" / "msg"
    folder.mkdir(parents=True)
    package = "<package format='3'><name>parts</name></package>"
    (folder.parent / "package.xml").write_text(package, encoding="utf-8")
    (folder / "Outer.msg").write_text("# outer\n\nInner inner  # field\n", encoding="utf-8")
    (folder / "Inner.msg").write_text("# inner\nint32 a\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("commented")
def test_comments_are_all_shown_or_none() -> None:
    show = ("interface", "show", "parts/msg/Outer")
    assert compose(*show, "--no-comments", "--all-comments").code == 2
    assert "outer" in compose(*show).out
    assert "inner\n" not in compose(*show).out.replace("Inner inner", "")
    assert "# inner\n" in compose(*show, "--all-comments").out
    assert "#" not in compose(*show, "--no-comments").out


def test_the_type_is_read_from_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("std_msgs/msg/Empty\n"))
    assert compose("interface", "show", "-", "--json").code == 0


def test_packages_and_their_types_are_listed() -> None:
    assert {"std_msgs", "std_srvs"} <= set(compose("interface", "packages").out.split())
    with_actions = compose("interface", "packages", "--only-actions").out.split()
    assert "composer_interfaces" in with_actions
    assert "std_msgs" not in with_actions
    types = compose("interface", "package", "composer_interfaces").out.split()
    assert types == [
        "composer_interfaces/srv/PlanTrajectory",
        "composer_interfaces/action/Navigate",
    ]
    actions = compose("interface", "package", "composer_interfaces", "-a", "--json").out
    assert json.loads(actions) == ["composer_interfaces/action/Navigate"]
    wrong = compose("interface", "package", "std_msg")
    assert wrong.code == 1
    assert "did you mean 'std_msgs'?" in wrong.err


def test_a_prototype_has_all_fields() -> None:
    twist = compose("interface", "proto", "geometry_msgs/msg/Twist").out
    vector = "  x: 0.0\n  y: 0.0\n  z: 0.0\n"
    assert twist == f'"linear:\n{vector}angular:\n{vector}"\n'
    request = compose("interface", "proto", "std_srvs/srv/SetBool", "--no-quotes").out
    assert yaml.safe_load(request) == {"data": False}
    cell = json.loads(compose("interface", "proto", "nav_msgs/msg/Odometry", "--json").out)
    assert cell["header"]["frame_id"] == ""
    assert cell["pose"]["covariance"] == [0.0] * 36
    assert cell["pose"]["pose"]["orientation"]["w"] == 1.0


def test_flat_does_not_expand_nested_messages() -> None:
    done = compose("interface", "show", "geometry_msgs/msg/PointStamped", "--flat")
    assert done.out.endswith("std_msgs/Header header\nPoint point\n")


def test_services_actions_and_constants_are_shown() -> None:
    shown = compose("interface", "show", "std_srvs/srv/SetBool", "--no-comments").out
    assert shown == "bool data\n---\nbool success\nstring message\n"
    action = compose("interface", "show", "composer_interfaces/action/Navigate", "--flat").out
    assert action.count("---\n") == 2
    assert "uint8 DEBUG=10" in compose("interface", "show", "rcl_interfaces/msg/Log").out


def test_types_can_be_listed_by_kind() -> None:
    services = compose("interface", "list", "--only-srvs").out.split()
    assert "std_srvs/srv/Trigger" in services
    assert all("/srv/" in name for name in services)
    everything = compose("interface", "list").out.split()
    assert {"std_msgs/msg/String", "composer_interfaces/action/Navigate"} <= set(everything)


def test_an_unknown_type_gets_a_suggestion() -> None:
    done = compose("interface", "show", "std_msgs/msg/Sting")
    assert done.code == 1
    assert "did you mean 'std_msgs/msg/String'?" in done.err


def test_json_output() -> None:
    listed = json.loads(compose("interface", "list", "--only-srvs", "--json").out)
    assert listed == compose("interface", "list", "--only-srvs").out.split()
    shown = json.loads(compose("interface", "show", "std_srvs/srv/SetBool", "--json").out)
    assert shown["name"] == "std_srvs/srv/SetBool"
    assert shown["request"]["fields"] == [{"name": "data", "type": "bool", "default": None}]
    log = json.loads(compose("interface", "show", "rcl_interfaces/msg/Log", "--json").out)
    assert {"name": "DEBUG", "type": "uint8", "value": 10} in log["message"]["constants"]
