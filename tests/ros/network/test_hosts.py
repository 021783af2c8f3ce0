"""Systems over several computers, each with its own network and ssh server."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.ros.network.namespaces import (
    PATIENCE_S,
    PERFECT,
    Computer,
    Quality,
    network,
    wait_until,
)
from tests.ros.network.split_system import WORKSPACE, SplitSystem
from tests.ros.network.ssh_servers import SshKeys
from tests.ros.support.commands import code_of_end

pytest.importorskip("asyncssh", reason="asyncssh is not installed")

#: Without the second signal, it waits 20 s for hosts that do not answer.
AT_ONCE_S = 15.0


@contextmanager
def split(
    folder: Path,
    *others: str,
    quality: Quality = PERFECT,
    trusted: bool = True,
    settings: str = "",
) -> Iterator[tuple[SplitSystem, SshKeys]]:
    """Make computers, with ssh servers on all but the first one, and a project on that."""
    with network(["base", *others], quality) as computers:
        keys_folder = folder / "keys"
        keys_folder.mkdir()
        keys = SshKeys(keys_folder)
        for computer in computers[1:]:
            keys.serve(computer, settings)
        if trusted:
            keys.trust(*computers[1:])
        system = SplitSystem(folder / "project", computers, keys)
        if trusted:
            done = system.compose("hosts", "sync", str(system.path))
            assert done.returncode == 0, done.stderr
        yield system, keys


def test_from_an_unknown_host_to_a_running_system_and_its_end(tmp_path: Path) -> None:
    with split(tmp_path, "robot", trusted=False) as (system, keys):
        (robot,) = system.others
        path = str(system.path)

        refused = system.compose("hosts", "run", path)
        assert refused.returncode == 1
        assert "robot (root@10.77.0.2): its host key is unknown" in refused.stderr
        assert "compare the fingerprint: ssh -o" in refused.stderr
        keys.trust(robot)

        robot.check("mkdir", WORKSPACE)
        robot.check("touch", f"{WORKSPACE}/precious")
        refused = system.compose("hosts", "sync", path, "--delete")
        assert refused.returncode == 1
        assert "holds other files, which were not copied by 'compose hosts sync'" in refused.stderr
        assert robot.check("ls", "-A", WORKSPACE) == "precious\n"
        robot.check("rm", f"{WORKSPACE}/precious")

        system.path.with_name("build").mkdir()
        system.path.with_name("build").joinpath("made").touch()
        listed = system.compose("hosts", "sync", path, "--dry-run")
        assert "robot: copy detector.py\n" in listed.stdout
        assert "robot: 3 files would be copied\n" in listed.stdout
        assert robot.check("ls", "-A", WORKSPACE) == ""
        assert system.compose("hosts", "sync", path).stdout == "robot: 3 files copied\n"

        robot.check("touch", f"{WORKSPACE}/old.py", f"{WORKSPACE}/.venv")
        robot.check("sh", "-c", f"echo >> {WORKSPACE}/detector.py")
        refused = system.compose("hosts", "run", path)
        assert refused.returncode == 1
        assert "robot (root@10.77.0.2): detector.py differs" in refused.stderr
        assert "copy the project with 'compose hosts sync'" in refused.stderr
        done = system.compose("hosts", "sync", path, "--delete")
        assert done.stdout == "robot: 1 file copied, 1 file deleted\n"
        names = ".compose-sync\n.venv\ncomposer.yaml\ndetector.py\nrobot.yaml\n"
        assert robot.check("ls", "-A", WORKSPACE) == names

        with system.up() as up:
            up.wait_for("3 of 3 nodes active")
            up.wait_for("] found picture")
            assert len(system.members()) == 2
            is_late = up.stop() != 0
            assert is_late == code_of_end(up.output)
            assert is_late or "/camera finalized" in up.output
        for nodes in (("detector",), ()):  # it has run on the other computer
            logged = system.compose("logs", *nodes).stdout
            assert logged.count("[detector] looking") == 1
        assert is_late or "/camera finalized" in logged

        check_that_nothing_is_left_of_a_killed_command(system)
        check_that_the_second_signal_ends_all_at_once(system)


def check_that_nothing_is_left_of_a_killed_command(system: SplitSystem) -> None:
    options = ("content=photo", "--namespace", "/lab", "--log-level", "debug")
    with system.up(*options) as up:
        up.wait_for("/lab/camera active")
        up.wait_for("] found photo")
        commands = [words for words in system.all_processes() if "--process" in words]
        assert all(" ".join(options) in words for words in commands)
        up.kill()
        wait_until(lambda: not system.all_processes(), "processes are left")


def check_that_the_second_signal_ends_all_at_once(system: SplitSystem) -> None:
    with system.up() as up:
        up.wait_for("3 of 3 nodes active")
        system.others[0].cut()  # its processes cannot be ended
        up.signal(signal.SIGINT)
        up.wait_for("ran for ")  # and now it waits for the other computer
        sent_s = time.monotonic()
        up.signal(signal.SIGINT)
        up.process.wait(PATIENCE_S)
        assert time.monotonic() - sent_s < AT_ONCE_S
        assert "Traceback" not in up.output


HOSTILE = r"""#!/bin/sh
printf '\033[2J\007evil\r\n[FATAL] [compose] forged\n' | tee /dev/stderr
[ -e "$(dirname "$0")/endless" ] && exec yes
exit 1
"""
MOST_CHARACTERS = 5000


def test_a_host_whose_every_command_is_hostile(tmp_path: Path) -> None:
    program = tmp_path / "hostile"
    program.write_text(HOSTILE)
    program.chmod(0o755)
    settings = f"ForceCommand {program}\nBanner {program}\n"
    with split(tmp_path, "robot", trusted=False, settings=settings) as (system, keys):
        keys.trust(*system.others)
        for is_endless in (False, True):
            if is_endless:
                program.with_name("endless").touch()
            for command in (("hosts", "run"), ("hosts", "sync")):
                done = system.compose(*command, str(system.path))
                output = done.stdout + done.stderr
                assert done.returncode == 1, output
                assert output.replace("\n", "").isprintable(), output
                assert not any(line.startswith("[FATAL]") for line in output.splitlines()), output
                assert "robot (root@10.77.0.2): " in output
                assert len(output) < MOST_CHARACTERS


@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize("others", [("robot",), ("robot", "arm")])
def test_a_cut_of_five_seconds_restarts_nothing(tmp_path: Path, others: tuple[str, ...]) -> None:
    with split(tmp_path, *others) as (system, _), system.up() as up:
        up.wait_for("] found picture")
        members = system.members()
        with cut(system.others[0], 5.0):
            pass
        up.wait_for("] found picture", len(up.lines) + 1)
        wait_until(lambda: states(system) == {"active"}, "the states do not converge")
        assert system.members() == members
        assert "connection lost" not in "\n".join(up.lines)
        assert up.stop() == code_of_end(up.output)


@pytest.mark.soak
@pytest.mark.timeout(300)
def test_a_request_that_arrives_after_a_cut_moves_nothing(tmp_path: Path) -> None:
    with split(tmp_path, "robot", "arm") as (system, _), system.up() as up:
        robot, arm = system.others
        seen = up.wait_for("] found picture")
        (killed,) = (pid for name, pid in system.members() if name == robot.name)
        with cut(arm, 9.0):  # longer than a process may be silent
            robot.check("kill", "-KILL", str(killed))
            up.wait_for("/logger inactive", seen)  # and then the detector, but that is cut off
            up.wait_for("has not reported for 5 s", seen)
        up.wait_for("ignored a request that has arrived too late: deactivate /detector", seen)
        wait_until(lambda: states(system) == {"active"}, "the states do not converge")
        up.wait_for("] found picture", len(up.lines) + 1)
        assert up.output.count("] looking") == 1  # the detector was active all the time
        assert up.stop() == code_of_end(up.output)


@pytest.mark.soak
@pytest.mark.timeout(300)
def test_a_process_and_a_host_that_are_gone_and_return(tmp_path: Path) -> None:
    with split(tmp_path, "robot", "arm") as (system, keys), system.up() as up:
        robot, arm = system.others
        up.wait_for("] found picture")
        seen = len(up.lines)
        (killed,) = (pid for name, pid in system.members() if name == arm.name)
        arm.check("kill", "-KILL", str(killed))
        up.wait_for("acting@arm | ended with exit code 137; starting again in 1 s", seen)
        seen = up.wait_for("/logger active", seen)
        on_arm = [found for found in system.members() if found[0] == arm.name]
        robot.cut()
        robot.kill_all()
        seen = up.wait_for("/detector inactive", seen)  # the dependents are paused
        keys.serve(robot)
        robot.join()
        up.wait_for("robot: connected again")
        up.wait_for("] found picture", seen)
        wait_until(lambda: states(system) == {"active"}, "the states do not converge")
        assert [found for found in system.members() if found[0] == arm.name] == on_arm
        assert len(system.members()) == 2
        assert up.stop() == code_of_end(up.output)


@pytest.mark.soak
@pytest.mark.timeout(300)
def test_slow_links_that_lose_packets(tmp_path: Path) -> None:
    quality = Quality(delay_ms=50.0, loss_percent=1.0)
    with split(tmp_path, "robot", "arm", quality=quality) as (system, _), system.up() as up:
        seen = up.wait_for("3 of 3 nodes active")
        for _ in range(20):
            seen = up.wait_for("] found picture", seen)
        assert len(system.members()) == 2
        assert up.stop() == code_of_end(up.output)


@pytest.mark.soak
@pytest.mark.timeout(300)
def test_processes_end_when_the_link_stays_cut(tmp_path: Path) -> None:
    with split(tmp_path, "robot") as (system, _), system.up() as up:
        up.wait_for("3 of 3 nodes active")
        system.others[0].cut()
        cut_s = time.monotonic()
        wait_until(lambda: not system.members(), "processes are left")
        assert time.monotonic() - cut_s > 25.0
        code = up.stop()
        assert code in (0, 1)


@contextmanager
def cut(computer: Computer, least_s: float) -> Iterator[None]:
    """Cut the link of a computer for the block, and for a time at least."""
    computer.cut()
    until_s = time.monotonic() + least_s
    yield
    while time.monotonic() < until_s:
        time.sleep(0.1)  # the length of the cut is what is tested
    computer.join()


def states(system: SplitSystem) -> set[str]:
    """Return the states of all nodes, as a command on the first computer sees them."""
    found = system.compose("ps", "--json")
    return {word for word in ("active", "inactive", "unconfigured") if f'"{word}"' in found.stdout}
