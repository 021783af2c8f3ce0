"""Units with which systemd runs a system."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath

import pytest

from composer.bridges.export.deployment import Service
from composer.bridges.export.systemd import Installation, units
from composer.client.hosts.remote_command import python_words
from composer.loading import load
from composer.model import Host, System
from tests.cli.compose import compose
from tests.programs import require

PYTHON = ("/opt/my robot/bin/python", "-P", "-m", "composer")
NODES = "nodes: {a: {on_activate: {log: a}}, b: {on_activate: {log: b}}, d: {log_level: warn}}\n"
PROCESSES = """\
processes:
  b_1: {nodes: [b], cpus: [0, 2], priority: 50, memory_mb: 500, environment: {PRICE: "5 % of $x"}}
  c: {host: jetson, nodes: [d]}
hosts: {jetson: {}}
"""


def system_of(folder: Path, text: str = "") -> tuple[System, Path]:
    path = folder / "my robot.yaml"
    path.write_text(f"system: robot\ndescription: 100 % \\\n{NODES}{text}")
    found = load(path).system
    assert found is not None
    return found, path


def remote(host: Host, service: Service) -> list[str]:
    return python_words(host, ("-m", "composer", *service.command("robot.yaml")), {})


def unit(system: tuple[System, Path], environment: dict[str, str], *, user: bool = False) -> str:
    found = units(*system, Installation(PYTHON, environment, remote), user=user)
    assert list(found) == [PurePosixPath("robot.service")]
    return found[PurePosixPath("robot.service")]


def test_a_unit_has_the_command_and_the_variables_of_ros(tmp_path: Path) -> None:
    environment = {
        "ROS_DOMAIN_ID": "7",
        "PYTHONPATH": '/a "b" $HOME',
        "HOME": "/root",
        "LD_LIBRARY_PATH": "/wheels",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }
    system = system_of(tmp_path)
    text = unit(system, environment)
    path = system[1]
    assert f'ExecStart="/opt/my robot/bin/python" -P -m composer run "{path}"\n' in text
    assert f"WorkingDirectory={path.parent}\n" in text
    assert "Description=ROS 2 system robot: 100 %%\n" in text
    assert [line for line in text.splitlines() if line.startswith("Environment=")] == [
        'Environment="PYTHONPATH=/a \\"b\\" $HOME"',
        "Environment=ROS_DOMAIN_ID=7",
    ]
    assert "RestartPreventExitStatus=2 78\n" in text
    assert "WantedBy=multi-user.target" in text
    assert "WantedBy=default.target" in unit(system, {}, user=True)
    assert "network-online.target" not in unit(system, {}, user=True)


def test_no_value_becomes_a_line_of_its_own(tmp_path: Path) -> None:
    value = "/a\nExecStartPre=/bin/sh\r\u2028\x1b\udcff%h\\"
    text = unit(system_of(tmp_path), {"PYTHONPATH": value})
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
    system = system_of(tmp_path)
    found = units(*system, Installation(PYTHON, environment, remote, "ada"), user=False)
    (text,) = found.values()
    assert "\nUser=ada\nWorkingDirectory=" in text
    assert [line for line in text.splitlines() if line.startswith("Environment=")] == [
        f"Environment={name}={value}" for name, value in environment.items()
    ]


def test_units_of_another_computer_run_as_its_user_or_as_who_exports_them(tmp_path: Path) -> None:
    for host, user, expected in (
        ("{workspace: ~/robot}", "ada", "User=ada\n"),
        ("{workspace: ~/robot}", "root", "User=root\n"),  # without it, there is no HOME
        ("{workspace: ~/robot, user: robot}", "ada", "User=robot\n"),
        ("{workspace: ~/robot, user: robot}", None, ""),
    ):
        system = system_of(tmp_path, PROCESSES.replace("jetson: {}", f"jetson: {host}"))
        found = units(*system, Installation(PYTHON, {}, remote, user), user=user is None)
        text = found[PurePosixPath("jetson/robot-c.service")]
        lines = [f"{line}\n" for line in text.splitlines() if line.startswith("User=")]
        assert "".join(lines) == expected


def test_the_command_names_its_user_also_if_that_is_root(tmp_path: Path) -> None:
    _, path = system_of(tmp_path)
    done = compose("export", "systemd", str(path))
    assert f"\nUser={pwd.getpwuid(os.geteuid()).pw_name}\n" in done.out
    assert "User=" not in compose("export", "systemd", str(path), "--user").out


def test_each_process_has_a_unit_with_its_limits(tmp_path: Path) -> None:
    found = {str(name): text for name, text in _units(tmp_path, PROCESSES).items()}
    names = ["robot.target", "robot.service", "robot-b-1.service", "jetson/robot-c.service"]
    assert list(found) == names
    assert "Wants=robot.service robot-b-1.service\n" in found["robot.target"]
    robot, process = found["robot.service"], found["robot-b-1.service"]
    assert " --await-processes\n" in robot
    assert "PartOf=robot.target\nAfter=robot-b-1.service\n" in robot
    for line in (
        "CPUAffinity=0 2",
        "MemoryMax=500000000",
        "LimitRTPRIO=50",
        'Environment="PRICE=5 %% of $x"',
        "PartOf=robot.target",
        "WantedBy=robot.target",
    ):
        assert f"{line}\n" in process
    assert " --process b_1\n" in process
    assert "WantedBy=multi-user.target\n" in found["jetson/robot-c.service"]


def test_a_discovery_server_starts_before_the_processes_of_its_computer(tmp_path: Path) -> None:
    server = "discovery: {kind: server, address: [10.0.0.1, 10.0.0.5], start: true}\n"
    text = PROCESSES.replace("jetson: {}", "jetson: {address: 10.0.0.5}") + server
    found = {str(name): text for name, text in _units(tmp_path, text).items()}
    name = "robot-discovery.service"
    assert {name, "jetson/robot-discovery-jetson.service"} < found.keys()
    assert f'composer hosts discovery-server "{tmp_path / "my robot.yaml"}"\n' in found[name]
    assert "WatchdogSec" not in found[name]
    assert "PartOf=robot.target\n" in found[name]
    assert name in found["robot.target"]
    assert f"Wants={name}\nAfter=robot-b-1.service {name}\n" in found["robot.service"]
    assert f"Wants={name}\nAfter={name}\n" in found["robot-b-1.service"]
    assert "Wants=robot-discovery-jetson.service\n" in found["jetson/robot-c.service"]
    alone = {str(name) for name in _units(tmp_path, server)}
    assert alone == {"robot.target", "robot.service", name}
    assert len(_units(tmp_path, server.replace(", start: true", ""))) == 1


def test_units_of_another_computer_use_its_workspace(tmp_path: Path) -> None:
    host = "jetson: {user: robot, workspace: '~/my %robot', setup: [/opt/ros/setup.bash]}"
    text = _units(tmp_path, PROCESSES.replace("jetson: {}", host))[
        PurePosixPath("jetson/robot-c.service")
    ]
    (line,) = (line for line in text.splitlines() if line.startswith("ExecStart="))
    assert line.startswith('ExecStart=/bin/bash -c "cd \\"$$HOME\\"/\'my %%robot\' || exit 71; ')
    assert line.endswith('-P -m composer run robot.yaml --process c"')
    assert "User=robot\n" in text
    assert str(tmp_path) not in text
    assert "RestartPreventExitStatus=2 71 72 73 78\n" in text


def test_restarts_follow_the_policy_of_the_system(tmp_path: Path) -> None:
    budget = "{max_attempts: 3, window_ms: 30000, backoff_ms: 250}"
    (text,) = _units(tmp_path, f"lifecycle: {{on_failure: restart, restart: {budget}}}\n").values()
    assert "StartLimitIntervalSec=30\nStartLimitBurst=4\n" in text
    assert "Restart=on-failure\nRestartSec=0.25\n" in text
    (text,) = _units(tmp_path, "lifecycle: {on_failure: shutdown}\n").values()
    assert "Restart=no\n" in text


def test_a_failure_ends_all_processes_of_a_system_that_shuts_down(tmp_path: Path) -> None:
    found = _units(tmp_path, f"{PROCESSES}lifecycle: {{on_failure: shutdown}}\n")
    assert "BindsTo=robot.service\nAfter=robot.service\n" in found[PurePosixPath("robot.target")]
    assert "BindsTo" not in _units(tmp_path, PROCESSES)[PurePosixPath("robot.target")]


def _units(folder: Path, text: str) -> dict[PurePosixPath, str]:
    return units(*system_of(folder, text), Installation(PYTHON, {}, remote), user=False)


def test_several_units_need_a_folder(tmp_path: Path) -> None:
    _, path = system_of(tmp_path, PROCESSES)
    done = compose("export", "systemd", str(path))
    assert done.code == 1
    assert "there are 4 units: robot.target, robot.service" in done.err
    done = compose("export", "systemd", str(path), "-o", str(tmp_path / "units"))
    assert done.code == 0, done.err
    assert (tmp_path / "units" / "jetson" / "robot-c.service").is_file()


@pytest.mark.parametrize("user", [False, True])
@pytest.mark.parametrize("policy", ["restart, restart: {backoff_ms: 250}", "shutdown"])
def test_systemd_accepts_the_units(policy: str, user: bool, tmp_path: Path) -> None:
    require(shutil.which("systemd-analyze"), "systemd-analyze is not installed (package systemd)")
    environment = {"ROS_DOMAIN_ID": "7", "PYTHONPATH": "/a b:/c%d"}
    python = (sys.executable, "-P", "-m", "composer")
    installation = Installation(python, environment, remote, None if user else "daemon")
    text = PROCESSES.replace("jetson: {}", "jetson: {address: 10.0.0.5, workspace: ~/robot}")
    text += f"lifecycle: {{on_failure: {policy}}}\n"
    text += "discovery: {kind: server, address: [10.0.0.1, 10.0.0.5], start: true}\n"
    system = system_of(tmp_path, text)
    files = []
    for name, text in units(*system, installation, user=user).items():
        files.append(tmp_path / name)
        files[-1].parent.mkdir(exist_ok=True)
        files[-1].write_text(text)
    command = ["systemd-analyze", "verify", *(["--user"] if user else []), *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    about = [line for line in done.stderr.splitlines() if "robot" in line]
    assert about == []
