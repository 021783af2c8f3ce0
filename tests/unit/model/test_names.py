"""Which names are valid, and what they become. tests/ros holds the same against rclpy."""

from __future__ import annotations

import pytest

from composer.model.names import (
    expand_name,
    is_hidden,
    is_selected,
    join,
    namespace_problem,
    node_name_problem,
    parameter_name_problem,
    topic_name_problem,
)

LETTER = "letters, digits and '_' are allowed"


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("planner", None),
        ("_planner2", None),
        ("a__b", None),
        ("a" * 255, None),
        ("", "is empty"),
        ("2nd", "begins with a digit"),
        ("a/b", f"contains '/'; {LETTER}"),
        ("my node", f"contains a space; {LETTER}"),
        ("nöde", f"contains 'ö'; {LETTER}"),
        ("a\x1b", f"contains U+001B; {LETTER}"),
        ("a" * 256, "has 256 characters, more than 255"),
    ],
)
def test_node_name(name: str, problem: str | None) -> None:
    assert node_name_problem(name) == problem


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("/", None),
        ("/robot1", None),
        ("robot1/arm", None),
        ("/" + "a" * 244, None),
        ("", "is empty"),
        ("/robot1/", "ends with '/'"),
        ("//robot1", "has an empty part between slashes"),
        ("~/robot1", "begins with '~', which has no meaning in a namespace"),
        ("/1robot", "has a part that begins with a digit: '1robot'"),
        ("/a__b", "contains '__'"),
        ("/" + "a" * 245, "has 246 characters, more than 245"),
    ],
)
def test_namespace(name: str, problem: str | None) -> None:
    assert namespace_problem(name) == problem


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("scan", None),
        ("/perception/scan", None),
        ("~/scan", None),
        ("~", None),
        ("_hidden", None),
        ("", "is empty"),
        ("/", "ends with '/'"),
        ("~/", "ends with '/'"),
        ("~scan", "has no '/' after '~'"),
        ("a/~", f"contains '~'; {LETTER}"),
        ("a//b", "has an empty part between slashes"),
        ("a/2b", "has a part that begins with a digit: '2b'"),
        ("a__b", "contains '__'"),
        ("{node}/scan", f"contains '{{'; {LETTER}"),
        ("a" * 248, "has 248 characters, more than 247"),
    ],
)
def test_topic_name(name: str, problem: str | None) -> None:
    assert topic_name_problem(name) == problem


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("max_velocity", None),
        ("camera.fps", None),
        ("", "is empty"),
        ("camera..fps", "has an empty part between dots"),
        ("camera.2", "has a part that begins with a digit: '2'"),
        ("max-velocity", f"contains '-'; {LETTER}"),
    ],
)
def test_parameter_name(name: str, problem: str | None) -> None:
    assert parameter_name_problem(name) == problem


@pytest.mark.parametrize(
    ("name", "expanded"),
    [
        ("/scan", "/scan"),
        ("scan", "/perception/scan"),
        ("front/scan", "/perception/front/scan"),
        ("~/scan", "/perception/camera/scan"),
        ("~", "/perception/camera"),
    ],
)
def test_expanding(name: str, expanded: str) -> None:
    assert expand_name(name, "camera", "/perception") == expanded


@pytest.mark.parametrize(
    ("namespace", "relative", "joined"),
    [
        ("/", "scan", "/scan"),
        ("", "scan", "/scan"),
        ("/a", "b/c", "/a/b/c"),
        ("/a/", "b", "/a/b"),
        ("a", "b", "/a/b"),
        ("/a", "", "/a"),
        ("/", "", "/"),
        ("/a", "/b", "/b"),
    ],
)
def test_joining(namespace: str, relative: str, joined: str) -> None:
    assert join(namespace, relative) == joined


@pytest.mark.parametrize(
    ("name", "hidden"), [("/a/_b", True), ("_a", True), ("/a/b_", False), ("/", False)]
)
def test_hidden(name: str, hidden: bool) -> None:
    assert is_hidden(name) is hidden


@pytest.mark.parametrize(
    ("target", "selected"),
    [
        ("/arm/left_driver", ["/arm/left_driver"]),
        ("left_driver", ["/arm/left_driver", "/leg/left_driver"]),
        ("arm/left_driver", ["/arm/left_driver"]),
        ("driver", []),
        ("*_driver", ["/arm/left_driver", "/leg/left_driver"]),
        ("arm*", ["/arm/armed"]),  # the last part of a name, not its namespace
        ("/arm/*", ["/arm/left_driver", "/arm/armed"]),
        ("arm/*", ["/arm/left_driver", "/arm/armed"]),
        ("/left_driver", []),
    ],
)
def test_what_users_select(target: str, selected: list[str]) -> None:
    names = ["/arm/left_driver", "/arm/armed", "/leg/left_driver"]
    assert [name for name in names if is_selected(name, target)] == selected
