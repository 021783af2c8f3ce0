"""The commands for other computers: what a shell there makes of them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

pytest.importorskip("asyncssh", reason="asyncssh is not installed")
from composer.client.hosts import sync
from composer.client.hosts.connection import HostError, failure_of, load_keys
from composer.client.hosts.remote_command import (
    NO_PYTHON,
    NO_SETUP,
    NO_WORKSPACE,
    python_command,
    quoted_path,
)
from tests.unit.support.hosts import host, located

PYTHON = """\
#!/bin/sh
printf '%s\\n' "$PWD" "$ROS_DOMAIN_ID" "$NOTE" "$@"
"""


def run(command: str, home: Path) -> subprocess.CompletedProcess[str]:
    environment = {"HOME": str(home), "PATH": "/usr/bin:/bin"}
    return subprocess.run(
        ["sh", "-c", command], check=False, capture_output=True, text=True, env=environment
    )


def test_python_runs_in_the_workspace_with_the_variables(tmp_path: Path) -> None:
    workspace = tmp_path / "my $(touch robot)"
    workspace.joinpath(".venv", "bin").mkdir(parents=True)
    python = workspace / ".venv" / "bin" / "python"
    python.write_text(PYTHON, encoding="utf-8")
    python.chmod(0o755)
    tmp_path.joinpath("setup.sh").write_text("NOTE=early; export NOTE\n", encoding="utf-8")
    there = host(
        f"~/{workspace.name}",
        setup=("~/setup.sh",),
        environment=((located("NOTE"), 'it\'s; "here"'),),
    )
    set_here = {"ROS_DOMAIN_ID": "7", "SECRET": "x"}
    done = run(python_command(there, ("-m", "it's", "$HOME"), set_here), tmp_path)
    assert done.stdout.splitlines() == [
        *(str(workspace), "7", 'it\'s; "here"'),
        *("-P", "-m", "it's", "$HOME"),
    ]
    guarded = run(python_command(there, ("-m", "x"), {}, 30.0), tmp_path).stdout
    words = ["composer.client.hosts.guard", "30", ".venv/bin/python", "-P", "-m", "x"]
    assert guarded.splitlines()[-6:] == words
    assert not tmp_path.joinpath("robot").exists()


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        ({"workspace": located("~/nowhere")}, NO_WORKSPACE),
        ({"setup": ("lost.sh",)}, NO_SETUP),
        ({"setup": ("/lost/setup.bash",)}, NO_SETUP),
        ({"python": "lost/python"}, NO_PYTHON),
    ],
)
def test_what_keeps_python_from_starting(
    tmp_path: Path, settings: dict[str, object], code: int
) -> None:
    command = python_command(host(str(tmp_path), **settings), ("-c", ""), {})
    assert run(command, tmp_path).returncode == code


def test_paths_for_a_shell() -> None:
    assert quoted_path("/opt/robot") == "/opt/robot"
    assert quoted_path("~/my robot") == "\"$HOME\"/'my robot'"
    assert quoted_path("$HOME") == "'$HOME'"


def test_rsync_has_the_options_of_the_host(tmp_path: Path) -> None:
    there = host(
        "~/robot",
        user=located("pilot"),
        address=located("fe80::1"),
        port=2222,
        identity_file="keys/my %h key",
        known_hosts="~/.ssh/robots",
    )
    options = sync.SyncOptions(tmp_path, delete=True)
    command = sync.rsync_command(there, "/home/pilot/robot", options)
    assert command[-2:] == [f"{tmp_path}/", "pilot@[fe80::1]:/home/pilot/robot/"]
    assert "--delete" in command
    assert "--dry-run" not in command
    (shell,) = (word for word in command if word.startswith("--rsh="))
    assert "-a -x -p 2222" in shell
    assert "StrictHostKeyChecking=yes" in shell
    assert f"'IdentityFile=\"{tmp_path}/keys/my %%h key\"'" in shell


def test_the_workspace_is_not_taken_from_other_output() -> None:
    """Files may be deleted there."""
    assert sync.folder_in("/opt/ros/jazzy\n\ncompose-workspace:/home/pilot/my robot\n") == (
        "/home/pilot/my robot"
    )
    assert sync.folder_in("/opt/ros/jazzy\n") is None
    assert sync.folder_in("compose-workspace:robot\n") is None


@pytest.mark.parametrize(
    ("code", "output", "reason"),
    [
        (NO_WORKSPACE, "sh: cd: no such folder", "there is no workspace '~/robot'"),
        (NO_PYTHON, "", "there is no Python '~/robot/.venv/bin/python' or 'python3'"),
        (1, "x: No module named 'composer'", "the Python there, '~/robot/.venv/bin/python' or"),
        (1, "Traceback\n  File\nOSError: full\n", "OSError: full"),
        (1, "", "the command failed with exit code 1"),
    ],
)
def test_why_a_command_has_failed(code: int, output: str, reason: str) -> None:

    error = failure_of(host("~/robot", user=located("pilot")), code, output)
    assert str(error).startswith(f"jetson (pilot@10.0.0.5): {reason}")


@pytest.mark.parametrize("name", ["keys/none", "~no-such-user/.ssh/id"])
def test_a_key_that_does_not_exist(tmp_path: Path, name: str) -> None:

    with pytest.raises(HostError, match=f"there is no file '{name}'"):
        load_keys(host("~/robot", identity_file=name), tmp_path)
