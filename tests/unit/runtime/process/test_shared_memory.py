"""Incomplete shared memory of killed processes is removed."""

from __future__ import annotations

import os
import stat
import threading
import time
from pathlib import Path

import pytest

from composer.runtime.process import StartRefused
from composer.runtime.process.shared_memory import remove_incomplete_ports

READY, INITIALIZING = b"\x02\0\0\0 the rest", b"\x01\0\0\0 the rest"
LONG_AGO_S = time.time() - 3600.0


def segment(folder: Path, name: str, content: bytes, *, old: bool = True) -> Path:
    path = folder / name
    path.write_bytes(content)
    if old:
        os.utime(path, (LONG_AGO_S, LONG_AGO_S))
    return path


@pytest.mark.parametrize(
    ("name", "content", "remains"),
    [
        ("fastrtps_port7411", b"", False),
        ("fastrtps_port7411", b"\0" * 52400, False),
        ("fastrtps_port7411", INITIALIZING, False),
        ("fastrtps_port7411", READY, True),
        ("fastrtps_port7411_el", b"", True),  # a lock file, which is empty
        ("fastrtps_0123456789abcdef", b"", True),  # not a port: new participants do not open it
        ("other_program", b"", True),
    ],
)
def test_only_incomplete_ports_are_removed(
    tmp_path: Path, name: str, content: bytes, remains: bool
) -> None:
    path = segment(tmp_path, name, content)
    remove_incomplete_ports(tmp_path)
    assert path.exists() == remains


def test_a_port_that_is_being_filled_is_kept(tmp_path: Path) -> None:
    path = segment(tmp_path, "fastrtps_port7411", b"", old=False)
    writer = threading.Timer(0.1, lambda: path.write_bytes(READY))
    writer.start()
    remove_incomplete_ports(tmp_path)
    writer.join()
    assert path.read_bytes() == READY


def test_a_new_incomplete_port_is_removed_after_a_second(tmp_path: Path) -> None:
    path = segment(tmp_path, "fastrtps_port7411", b"", old=False)
    remove_incomplete_ports(tmp_path)
    assert not path.exists()


def test_a_missing_folder_is_ignored(tmp_path: Path) -> None:
    remove_incomplete_ports(tmp_path / "nowhere")


@pytest.mark.skipif(os.getuid() == 0, reason="root may remove everything")
def test_a_port_of_another_user_is_an_error(tmp_path: Path) -> None:
    path = segment(tmp_path, "fastrtps_port7411", b"")
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    try:
        with pytest.raises(StartRefused, match="fastrtps_port7411") as refusal:
            remove_incomplete_ports(tmp_path)
    finally:
        tmp_path.chmod(stat.S_IRWXU)
    assert f"remove {path}" in refusal.value.hint
