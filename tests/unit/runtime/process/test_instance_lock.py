"""Instance locks: one process per system and domain, in a folder that only this user can write."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from composer.runtime.process import StartRefused
from composer.runtime.process.instance_lock import hold_instance_lock, local_systems

OTHER_USER = 65534
NAME = "/robot"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of the lock files, which does not exist yet."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    return tmp_path / f"ros2-composer-{os.geteuid()}"


def test_a_held_lock_refuses_a_second_process_and_is_listed(folder: Path) -> None:
    with hold_instance_lock(NAME):
        assert local_systems() == {NAME: str(os.getpid())}
        with pytest.raises(StartRefused, match="already runs"), hold_instance_lock(NAME):
            pass
    assert local_systems() == {}
    assert folder.stat().st_mode & 0o777 == 0o700


def test_a_symbolic_link_in_place_of_the_folder_is_refused(folder: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    folder.symlink_to(elsewhere)
    with pytest.raises(StartRefused, match="other users can write"), hold_instance_lock(NAME):
        pass
    assert local_systems() == {}
    assert list(elsewhere.iterdir()) == []


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


def test_a_folder_that_others_can_write_to_is_refused(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.raises(StartRefused, match="other users can write"), hold_instance_lock(NAME):
        pass


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_folder_of_another_user_is_refused(folder: Path) -> None:
    folder.mkdir(mode=0o700)
    os.chown(folder, OTHER_USER, OTHER_USER)
    with pytest.raises(StartRefused, match="other users can write"):
        hold_instance_lock(NAME).__enter__()
    assert list(folder.iterdir()) == []
