"""Interfaces that have changed since they were built."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from tests.unit.interfaces.test_index import package, prefix

SYSTEM = """\
system: demo
nodes:
  hand:
    publishers: {grip: {type: arm_interfaces/msg/Grip, qos: command, external: true}}
    subscriptions: {want: {type: arm_interfaces/msg/Grip, qos: command, external: true, log: x}}
"""


@pytest.mark.parametrize(
    ("files", "command"),
    [([], "compose interface build arm_interfaces   or: "), (["pyproject.toml"], "pip install ")],
)
def test_a_changed_message_is_an_error_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: list[str], command: str
) -> None:
    source = package(tmp_path / "interfaces" / "arm", "arm_interfaces", msg_Grip="float64 force")
    for name in files:
        (source / name).touch()
    prefix(tmp_path / "install", "arm_interfaces", msg_Grip="float32 force")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    (tmp_path / "demo.yaml").write_text(SYSTEM)
    [diagnostic] = load(tmp_path / "demo.yaml").diagnostics
    assert diagnostic.rule.name == "outdated-interface"
    assert diagnostic.message == (
        "'arm_interfaces/msg/Grip' has changed since the package 'arm_interfaces' was built"
    )
    assert (diagnostic.hint or "").startswith(command)
    (source / "msg" / "Grip.msg").write_text("float32 force # in newtons")
    assert load(tmp_path / "demo.yaml").diagnostics == []
