"""Instance locks: one process per system and domain, in a folder that only this user can write."""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from composer.runtime.clock import COMPUTER
from composer.runtime.process import StartRefused, instance_lock
from composer.runtime.process.instance_lock import hold_instance_lock, is_held, local_systems

OTHER_USER = 65534
NAME = "/robot"
REAL_SLEEP = time.sleep


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of the lock files, which does not exist yet."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    return tmp_path / f"ros2-composer-{os.geteuid()}"


def test_a_held_lock_refuses_a_second_process_and_is_listed(folder: Path) -> None:
    assert not is_held(NAME)
    assert list(folder.iterdir()) == [], "looking for a lock creates no file"
    with hold_instance_lock(NAME):
        assert local_systems() == {NAME: str(os.getpid())}
        with pytest.raises(StartRefused, match="already runs"), hold_instance_lock(NAME):
            pass
    assert local_systems() == {}
    assert folder.stat().st_mode & 0o777 == 0o700


def test_a_start_waits_for_a_process_that_only_looks(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with hold_instance_lock(NAME):
        pass
    with (folder / "7.robot.lock").open() as looking:
        fcntl.flock(looking, fcntl.LOCK_SH)
        polls = iter(range(30))

        def sleep(_: float) -> None:
            """Count the polls of a busy computer, and end the look with the last one."""
            REAL_SLEEP(0.005)
            if next(polls) == 29:
                fcntl.flock(looking, fcntl.LOCK_UN)

        monkeypatch.setattr(COMPUTER, "sleep", sleep)
        with hold_instance_lock(NAME):
            assert is_held(NAME)


@pytest.mark.parametrize("session", ["/run/user/1000", ""])
def test_a_login_session_and_a_service_share_the_folder(
    session: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(instance_lock, "COMMON_FOLDER", str(folder.parent))
    monkeypatch.setenv("XDG_RUNTIME_DIR", session)
    with hold_instance_lock(NAME):
        monkeypatch.delenv("XDG_RUNTIME_DIR")
        assert local_systems() == {NAME: str(os.getpid())}
        assert (folder / "7.robot.lock").exists()


@pytest.mark.skipif(shutil.which("systemd-tmpfiles") is None, reason="needs systemd-tmpfiles")
def test_old_lock_files_stay_while_a_system_runs(folder: Path, tmp_path: Path) -> None:
    configuration = tmp_path.with_suffix(".conf")
    configuration.write_text(f'q "{tmp_path}" - - - mM:10d\n')
    clean = ("systemd-tmpfiles", "--clean", str(configuration))
    with hold_instance_lock(NAME):
        for path in (*folder.iterdir(), folder):
            os.utime(path, (0.0, 0.0))
        subprocess.run(clean, check=True, capture_output=True)
        assert is_held(NAME)
    for path in (*folder.iterdir(), folder):
        os.utime(path, (0.0, 0.0))
    subprocess.run(clean, check=True, capture_output=True)
    assert not folder.exists()


@pytest.mark.parametrize(
    "kind",
    [
        *("symbolic link", "writable"),
        pytest.param(
            "of another user",
            marks=pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away"),
        ),
    ],
)
def test_a_folder_that_others_can_write_to_is_refused(
    kind: str, folder: Path, tmp_path: Path
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    if kind == "symbolic link":
        folder.symlink_to(elsewhere)
    else:
        elsewhere.rename(folder)
    if kind == "writable":
        folder.chmod(0o777)
    if kind == "of another user":
        os.chown(folder, OTHER_USER, OTHER_USER)
    with pytest.raises(StartRefused, match="other users can write"), hold_instance_lock(NAME):
        pass
    assert local_systems() == {}
    assert list(folder.iterdir()) == []


def test_a_symbolic_link_in_place_of_a_lock_file_is_not_followed(
    folder: Path, tmp_path: Path
) -> None:
    valuable = tmp_path / "valuable"
    valuable.write_text("data")
    folder.mkdir(mode=0o700)
    (folder / "7.robot.lock").symlink_to(valuable)
    with hold_instance_lock(NAME):
        pass
    assert valuable.read_text() == "data"
