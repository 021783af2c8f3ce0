"""Participants are counted by their UDP ports, and receive buffers are enlarged."""

from __future__ import annotations

import socket
from pathlib import Path

from composer.runtime.middleware.dds_participants import count_participants, enlarge_receive_buffers

HEAD = "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  inode\n"


def table(folder: Path, *ports: int) -> Path:
    path = folder / "udp"
    path.write_text(
        HEAD + "".join(f"  {port}: 00000000:{port:04X} 00000000:0000 07\n" for port in ports),
        encoding="ascii",
    )
    return path


def test_a_participant_has_one_discovery_port(tmp_path: Path) -> None:
    assert count_participants(0, tmp_path / "udp") == 0  # without a list of ports
    for_data, multicast, unrelated = (7411, 7413), (7400, 7401), (53, 68, 40000)
    path = table(tmp_path, 7410, 7412, 7410, *for_data, *multicast, *unrelated)
    assert count_participants(0, path) == 2
    path = table(tmp_path, 7400 + 250 * 41 + 10, 7400 + 250 * 42 + 248, 7400 + 250 * 43)
    assert [count_participants(domain_id, path) for domain_id in (40, 41, 42, 43)] == [0, 1, 1, 0]


def test_only_udp_sockets_get_larger_buffers() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
        socket.socket(socket.AF_INET, socket.SOCK_STREAM) as tcp,
    ):
        before = [buffer_size(udp), buffer_size(tcp)]
        enlarge_receive_buffers()
        assert buffer_size(udp) > before[0]
        assert buffer_size(tcp) == before[1]


def buffer_size(opened: socket.socket) -> int:
    return opened.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
