"""Units with which systemd runs a system."""

from __future__ import annotations

import os
import pwd
from pathlib import Path, PurePosixPath

import pytest

from composer.bridges.export.deployment import Service
from composer.bridges.export.systemd import Installation, units
from composer.client.hosts.remote_command import python_words
from composer.loading import load_models
from composer.model import Host, System
from tests.cli.compose import compose

PYTHON = ("/opt/my robot/bin/python", "-P", "-m", "composer")
NODES = "nodes: {a: {on_activate: {log: a}}, b: {on_activate: {log: b}}, d: {log_level: warn}}\n"
PROCESSES = """\
processes:
  b_1: {nodes: [b]}
  c: {host: jetson, nodes: [d]}
hosts: {jetson: {}}
"""


def system_of(folder: Path, text: str = "") -> tuple[System, Path]:
    path = folder / "my robot.yaml"
    path.write_text(f"system: robot\ndescription: 100 % \\\n{NODES}{text}")
    found = load_models([path])[0].system
    assert found is not None
    return found, path


def remote(host: Host, service: Service) -> list[str]:
    return python_words(host, ("-m", "composer", *service.command("robot.yaml")), {})


def test_no_value_becomes_a_line_of_its_own(tmp_path: Path) -> None:
    value = "/a\nExecStartPre=/bin/sh\r\u2028\x1b\udcff%h\\"
    installation = Installation(PYTHON, {"PYTHONPATH": value}, remote)
    (text,) = units(*system_of(tmp_path), installation, user=False).values()
    expected = r"/a\x0aExecStartPre=/bin/sh\x0d\xe2\x80\xa8\x1b\xff%%h"
    assert f'Environment="PYTHONPATH={expected}\\\\"\n' in text


@pytest.mark.parametrize("form", ["launch", "systemd", "docker-compose", "kubernetes"])
def test_paths_with_control_characters_are_not_exported(tmp_path: Path, form: str) -> None:
    folder = tmp_path / "a\nRUN x"
    folder.mkdir()
    done = compose("export", form, str(system_of(folder)[1]))
    assert (done.code, done.out) == (1, "")
    assert "has control characters\n  rename the file or its folder" in done.err


def test_a_unit_runs_as_who_exports_it_with_the_files_that_are_set(tmp_path: Path) -> None:
    environment = {
        "FASTRTPS_DEFAULT_PROFILES_FILE": "/home/ada/profiles.xml",
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_KEYSTORE": "/home/ada/keystore",
    }
    others = {"HOME": "/root", "LD_LIBRARY_PATH": "/wheels", "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    installation = Installation(PYTHON, environment | others, remote, "ada")
    (text,) = units(*system_of(tmp_path), installation, user=False).values()
    assert "\nUser=ada\nWorkingDirectory=" in text
    assert [line for line in text.splitlines() if line.startswith("Environment=")] == [
        f"Environment={name}={value}" for name, value in environment.items()
    ]


@pytest.mark.parametrize(
    ("host", "user", "expected"),
    [
        ("{workspace: ~/robot}", "ada", ["User=ada"]),
        ("{workspace: ~/robot}", "root", ["User=root"]),  # without it, there is no HOME
        ("{workspace: ~/robot, user: robot}", "ada", ["User=robot"]),
        ("{workspace: ~/robot, user: robot}", None, []),
    ],
)
def test_users_of_units(host: str, user: str | None, expected: list[str], tmp_path: Path) -> None:
    system = system_of(tmp_path, PROCESSES.replace("jetson: {}", f"jetson: {host}"))
    found = units(*system, Installation(PYTHON, {}, remote, user), user=user is None)
    text = found[PurePosixPath("jetson/robot-c.service")]
    assert [line for line in text.splitlines() if line.startswith("User=")] == expected


def test_the_command_names_its_user_also_if_that_is_root(tmp_path: Path) -> None:
    _, path = system_of(tmp_path)
    done = compose("export", "systemd", str(path))
    assert f"\nUser={pwd.getpwuid(os.geteuid()).pw_name}\n" in done.out
    assert "User=" not in compose("export", "systemd", str(path), "--user").out


def test_several_units_need_a_folder(tmp_path: Path) -> None:
    _, path = system_of(tmp_path, PROCESSES)
    done = compose("export", "systemd", str(path))
    assert done.code == 1
    assert "there are 4 units: robot.target, robot.service" in done.err
    done = compose("export", "systemd", str(path), "-o", str(tmp_path / "units"))
    assert done.code == 0, done.err
    assert (tmp_path / "units" / "jetson" / "robot-c.service").is_file()
