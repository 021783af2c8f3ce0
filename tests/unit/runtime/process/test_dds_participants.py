"""The ports that Linux says are held, read as participants, and what ours can hold."""

from __future__ import annotations

import socket
from pathlib import Path

from composer.runtime.process.dds_participants import count_participants, enlarge_receive_buffers

HEAD = "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  inode\n"


def table(folder: Path, *ports: int) -> Path:
    path = folder / "udp"
    path.write_text(
        HEAD + "".join(f"  {port}: 00000000:{port:04X} 00000000:0000 07\n" for port in ports),
        encoding="ascii",
    )
    return path


def test_a_participant_is_a_port_for_discovery(tmp_path: Path) -> None:
    for_data, multicast, of_others = (7411, 7413), (7400, 7401), (53, 68, 40000)
    path = table(tmp_path, 7410, 7412, *for_data, *multicast, *of_others)
    assert count_participants(0, path) == 2


def test_a_port_held_twice_is_one_participant(tmp_path: Path) -> None:
    assert count_participants(0, table(tmp_path, 7410, 7410)) == 1


def test_each_domain_has_its_ports(tmp_path: Path) -> None:
    path = table(tmp_path, 7400 + 250 * 41 + 10, 7400 + 250 * 42 + 248, 7400 + 250 * 43)
    assert [count_participants(domain_id, path) for domain_id in (40, 41, 42, 43)] == [0, 1, 1, 0]


def test_where_nobody_tells_nobody_is_counted(tmp_path: Path) -> None:
    assert count_participants(0, tmp_path / "udp") == 0


def test_udp_sockets_get_more_room_and_others_are_left_alone() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
        socket.socket(socket.AF_INET, socket.SOCK_STREAM) as tcp,
    ):
        before = [room(udp), room(tcp)]
        enlarge_receive_buffers()
        assert room(udp) > before[0]
        assert room(tcp) == before[1]


def room(end: socket.socket) -> int:
    return end.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
