"""Which addresses, users and workspaces of hosts can be used."""

from __future__ import annotations

import pytest

from composer.model.hosts import (
    address_problem,
    domain_problem,
    key_file_problem,
    name_problem,
    user_problem,
    workspace_problem,
)


@pytest.mark.parametrize("text", ["~/robot", "/opt/robot", "/home/pilot/robot", "~/ws/robot"])
def test_workspaces(text: str) -> None:
    assert workspace_problem(text) is None


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "neither"),
        (".", "neither"),
        ("robot", "neither"),
        ("~pilot/robot", "neither"),
        ("/", "root"),
        ("//", "root"),
        ("~", "home folder"),
        ("~/", "home folder"),
        ("~/.", "home folder"),
        ("/home/pilot", "home folder"),
        ("/home/pilot/", "home folder"),
        ("/usr", "operating system"),
        ("/opt/../etc", ".."),
        ("~/a\nb", "control"),
    ],
)
def test_unsafe_workspaces(text: str, part: str) -> None:
    problem = workspace_problem(text)
    assert problem is not None
    assert part in problem


PROBLEMS = {
    "name": name_problem,
    "address": address_problem,
    "user": user_problem,
    "file": key_file_problem,
}


@pytest.mark.parametrize(
    ("what", "texts"),
    [
        ("name", ("jetson", "Arm-2", "7", "a" * 63)),
        ("address", ("robot", "10.0.0.5", "::1", "fe80::1%eth0", "jetson.local", "arm_1")),
        ("user", ("robot", "a.b", "_ros-2", "müller")),
        ("file", ("~/.ssh/id", "keys/my %h key", "it's", "..id")),
    ],
)
def test_words_that_can_be_used(what: str, texts: tuple[str, ...]) -> None:
    assert [text for text in texts if PROBLEMS[what](text) is not None] == []


@pytest.mark.parametrize("what", ["name", "address", "user"])
@pytest.mark.parametrize(
    "text",
    ["", "-oProxyCommand=x", "a b", "a\n", "me@there", "a'b", "x/y", "..", "%n", "$(x)", "a;b"],
)
def test_words_that_cannot_be_used(what: str, text: str) -> None:
    assert PROBLEMS[what](text) is not None


@pytest.mark.parametrize(
    ("what", "text"),
    [
        *(("name", text) for text in ("a.b", "a_b", "a-", "a" * 64, "müller")),
        *(("address", text) for text in ("999.1.1.1", f"{'9' * 5000}.1.1.1", "fe80::1%a b", "a:b")),
        *(("file", text) for text in ('a"b', "a\nb", "a\\b", "${HOME}/id")),
    ],
)
def test_other_words_that_cannot_be_used(what: str, text: str) -> None:
    assert PROBLEMS[what](text) is not None


@pytest.mark.parametrize("text", ["", "0", "7", "007", "101", "232", "0" * 5000])
def test_domains_that_ros_accepts(text: str) -> None:
    assert domain_problem(text) is None


@pytest.mark.parametrize("text", ["233", "700", "-1", "1.5", " 7", "seven", "²", "9" * 5000])
def test_domains_that_ros_refuses(text: str) -> None:
    assert domain_problem(text) == "is not a number from 0 to 232"
