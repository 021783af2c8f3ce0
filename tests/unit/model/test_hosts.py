"""Which addresses, users and workspaces of hosts can be used."""

from __future__ import annotations

import pytest

from composer.model.hosts import domain_problem, login_problem, workspace_problem


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


@pytest.mark.parametrize("text", ["robot", "10.0.0.5", "fe80::1%eth0", "jetson.local"])
def test_logins(text: str) -> None:
    assert login_problem(text) is None


@pytest.mark.parametrize("text", ["", "-oProxyCommand=x", "a b", "a\n", "me@there", "a'b", "x/y"])
def test_unusable_logins(text: str) -> None:
    assert login_problem(text) is not None


@pytest.mark.parametrize("text", ["", "0", "7", "007", "101", "232", "0" * 5000])
def test_domains_that_ros_accepts(text: str) -> None:
    assert domain_problem(text) is None


@pytest.mark.parametrize("text", ["233", "700", "-1", "1.5", " 7", "seven", "²", "9" * 5000])
def test_domains_that_ros_refuses(text: str) -> None:
    assert domain_problem(text) == "is not a number from 0 to 232"
