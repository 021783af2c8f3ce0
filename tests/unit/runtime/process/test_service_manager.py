"""Messages to the service manager."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from composer.runtime.process.signals import READY, ServiceManager


@pytest.mark.parametrize("address", ["notify", "\0composer-test"])
def test_messages_arrive_at_its_socket(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as service_manager:
        service_manager.bind(address)
        environment = {"NOTIFY_SOCKET": address.replace("\0", "@"), "HOME": "/"}
        service = ServiceManager(environment)
        assert environment == {"HOME": "/"}  # children do not inherit it
        service.send(READY, "STATUS=all nodes are up")
        assert service_manager.recv(1000) == b"READY=1\nSTATUS=all nodes are up"
    service.send(READY)  # it is gone


def test_without_one_messages_go_nowhere() -> None:
    ServiceManager({}).send(READY)
