"""What DDS uses of this computer: shared memory, ports of participants, receive buffers."""

from __future__ import annotations

import fcntl
import os
import socket
import threading
import time
from pathlib import Path

import pytest

from composer.runtime.middleware.local_resources import (
    count_participants,
    enlarge_receive_buffers,
    remove_dead_segments,
    remove_incomplete_ports,
)
from composer.runtime.process import StartRefused

READY, INITIALIZING = b"\x02\0\0\0 the rest", b"\x01\0\0\0 the rest"
LONG_AGO_S = time.time() - 3600.0
#: Its participants use the ports from 7400 on, those of domain 1 from 7650 on.
DOMAIN = 0
OTHER_USER = 65534


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
        ("fastrtps_port7661", b"", False),  # of another domain, but of this user
    ],
)
def test_only_incomplete_ports_are_removed(
    tmp_path: Path, name: str, content: bytes, remains: bool
) -> None:
    path = segment(tmp_path, name, content)
    remove_incomplete_ports(DOMAIN, tmp_path)
    assert path.exists() == remains


def test_a_port_that_is_being_filled_is_kept(tmp_path: Path) -> None:
    path = segment(tmp_path, "fastrtps_port7411", b"", old=False)
    writer = threading.Timer(0.1, lambda: path.write_bytes(READY))
    writer.start()
    remove_incomplete_ports(DOMAIN, tmp_path)
    writer.join()
    assert path.read_bytes() == READY


def test_a_new_incomplete_port_is_removed_after_a_second(tmp_path: Path) -> None:
    path = segment(tmp_path, "fastrtps_port7411", b"", old=False)
    remove_incomplete_ports(DOMAIN, tmp_path)
    assert not path.exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_an_incomplete_port_of_another_user_is_kept_and_affects_only_its_domain(
    tmp_path: Path,
) -> None:
    path = segment(tmp_path, "fastrtps_port7661", b"")
    os.chown(path, OTHER_USER, OTHER_USER)
    remove_incomplete_ports(DOMAIN, tmp_path)
    with pytest.raises(StartRefused, match=r"fastrtps_port7661 .*owner: user 65534") as refusal:
        remove_incomplete_ports(DOMAIN + 1, tmp_path)
    assert f"remove {path}" in refusal.value.hint
    assert path.exists()


def test_a_fifo_named_like_a_port_is_refused_without_opening_its_other_end(tmp_path: Path) -> None:
    path = tmp_path / "fastrtps_port7411"
    os.mkfifo(path)
    with pytest.raises(StartRefused, match="not shared memory"):
        remove_incomplete_ports(DOMAIN, tmp_path)
    assert path.is_fifo()
    remove_incomplete_ports(DOMAIN + 1, tmp_path)


def test_a_symbolic_link_named_like_a_port_is_not_followed(tmp_path: Path) -> None:
    """shm_open does not follow it either, so it hangs no participant."""
    target = segment(tmp_path, "target", b"")
    link = tmp_path / "fastrtps_port7411"
    link.symlink_to(target)
    remove_incomplete_ports(DOMAIN, tmp_path)
    remove_incomplete_ports(DOMAIN, tmp_path / "nowhere")
    assert link.is_symlink()
    assert target.exists()


def test_segments_are_removed_if_nothing_locks_them(tmp_path: Path) -> None:
    remove_dead_segments(tmp_path / "nowhere")
    names = {kind: f"fastrtps_{kind:0<16}" for kind in ("dead", "a1e", "feed")}
    for kind, name in names.items():
        segment(tmp_path, name, READY)
        segment(tmp_path, f"{name}_el", b"", old=kind != "feed")
    lone = segment(tmp_path, "fastrtps_0123456789abcdef", READY)
    link = tmp_path / "fastrtps_00000000000000ff"
    link.with_name(f"{link.name}_el").symlink_to(lone)
    segment(tmp_path, link.name, READY)
    with (tmp_path / f"{names['a1e']}_el").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        remove_dead_segments(tmp_path)
    remain = {path.name for path in tmp_path.iterdir()}
    dead = {names["dead"], f"{names['dead']}_el"}
    assert not dead & remain
    assert {names["a1e"], names["feed"], lone.name, link.name} < remain
    assert len(remain) == 7


HEAD = "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  inode\n"


def table(folder: Path, *ports: int) -> Path:
    lines = (f"  {port}: 00000000:{port:04X} 00000000:0000 07\n" for port in ports)
    (folder / "udp").write_text(HEAD + "".join(lines), encoding="ascii")
    return folder / "udp"


def test_a_participant_has_one_discovery_port(tmp_path: Path) -> None:
    assert count_participants(0, tmp_path / "udp") == 0  # without a list of ports
    for_data, multicast, unrelated = (7411, 7413), (7400, 7401), (53, 68, 40000)
    path = table(tmp_path, 7410, 7412, 7410, *for_data, *multicast, *unrelated)
    assert count_participants(0, path) == 2
    path = table(tmp_path, 7400 + 250 * 41 + 10, 7400 + 250 * 42 + 248, 7400 + 250 * 43)
    assert [count_participants(domain_id, path) for domain_id in (40, 41, 42, 43)] == [0, 1, 1, 0]


def test_only_udp_sockets_get_larger_buffers() -> None:
    def sizes() -> list[int]:
        return [item.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) for item in (udp, tcp)]

    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
        socket.socket(socket.AF_INET, socket.SOCK_STREAM) as tcp,
    ):
        before = sizes()
        enlarge_receive_buffers()
        assert sizes()[0] > before[0]
        assert sizes()[1] == before[1]
