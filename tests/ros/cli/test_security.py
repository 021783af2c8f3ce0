"""Security is enabled, but the middleware has no security libraries, as in the wheels from PyPI."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.ros.support.commands import compose

REASON = "security is enabled, but this build of Fast DDS has no security libraries"
SYSTEM = "system: lamp\nnodes:\n  one: {on_activate: {log: started}}\n"
KEYS = (
    "cert.pem",
    "governance.p7s",
    "identity_ca.cert.pem",
    "key.pem",
    "permissions.p7s",
    "permissions_ca.cert.pem",
)


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the file of a system, in a folder with a keystore."""
    enclaves = tmp_path / "keys" / "enclaves"
    enclaves.mkdir(parents=True)
    for name in KEYS:
        (enclaves / name).touch()
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path / "keys"))
    found = tmp_path / "lamp.yaml"
    found.write_text(SYSTEM)
    return found


@pytest.mark.parametrize("command", [("node", "list"), ("run",)])
def test_a_command_says_that_security_is_not_available(
    command: tuple[str, ...], path: Path
) -> None:
    done = compose(*command, *([path] if command == ("run",) else []))
    assert done.returncode == 1
    assert f"compose: ROS does not start: {REASON}\n" in done.stderr
    assert "unset ROS_SECURITY_ENABLE" in done.stderr
    assert "internal error" not in done.stderr


def test_the_doctor_reports_it(path: Path) -> None:
    done = compose("doctor")
    assert done.returncode == 1
    assert f"error    middleware   ROS does not start: {REASON}\n" in done.stdout
