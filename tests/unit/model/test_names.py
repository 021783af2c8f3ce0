"""Which names are valid, and what they become. tests/ros holds the same against rclpy."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from composer.model.names import (
    is_hidden,
    is_selected,
    join,
    namespace_problem,
    node_name_problem,
    parameter_name_problem,
    topic_name_problem,
)

LETTER = "letters, digits and '_' are allowed"
#: By check: names and what is wrong with them.
PROBLEMS: dict[Callable[[str], str | None], dict[str, str | None]] = {
    node_name_problem: {
        **dict.fromkeys(("planner", "_planner2", "a__b", "a" * 255)),
        "": "is empty",
        "2nd": "begins with a digit",
        "a/b": f"contains '/'; {LETTER}",
        "my node": f"contains a space; {LETTER}",
        "nöde": f"contains 'ö'; {LETTER}",
        "a\x1b": f"contains U+001B; {LETTER}",
        "a" * 256: "has 256 characters, more than 255",
    },
    namespace_problem: {
        **dict.fromkeys(("/", "/robot1", "robot1/arm", "/" + "a" * 244)),
        "": "is empty",
        "/robot1/": "ends with '/'",
        "//robot1": "has an empty part between slashes",
        "~/robot1": "begins with '~', which has no meaning in a namespace",
        "/1robot": "has a part that begins with a digit: '1robot'",
        "/a__b": "contains '__'",
        "/" + "a" * 245: "has 246 characters, more than 245",
    },
    topic_name_problem: {
        **dict.fromkeys(("scan", "/perception/scan", "~/scan", "~", "_hidden")),
        "": "is empty",
        "/": "ends with '/'",
        "~/": "ends with '/'",
        "~scan": "has no '/' after '~'",
        "a/~": f"contains '~'; {LETTER}",
        "a//b": "has an empty part between slashes",
        "a/2b": "has a part that begins with a digit: '2b'",
        "a__b": "contains '__'",
        "{node}/scan": f"contains '{{'; {LETTER}",
        "a" * 248: "has 248 characters, more than 247",
    },
    parameter_name_problem: {
        **dict.fromkeys(("max_velocity", "camera.fps")),
        "": "is empty",
        "camera..fps": "has an empty part between dots",
        "camera.2": "has a part that begins with a digit: '2'",
        "max-velocity": f"contains '-'; {LETTER}",
    },
}


@pytest.mark.parametrize(
    ("check", "name", "problem"),
    [(check, *case) for check, cases in PROBLEMS.items() for case in cases.items()],
)
def test_problems(check: Callable[[str], str | None], name: str, problem: str | None) -> None:
    assert check(name) == problem


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


def test_hidden_names() -> None:
    names = ("/a/_b", "_a", "/a/b_", "/")
    assert [is_hidden(name) for name in names] == [True, True, False, False]


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
