"""The manager leaves large answers to the services of ROS."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.remote.local_queries import local_parameters
from tests.ros.support.commands import running
from tests.ros.support.in_process import wait_until

SYSTEM = """
system: queried
nodes:
  small: {parameters: {numbers: {type: integer_array, default: [1, 2]}, limit: 1.5}}
  large: {parameters: {numbers: {type: integer_array, default: [%s]}}}
"""
LIMIT_S = 10.0


def test_large_parameters_are_left_to_the_parameter_services(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")  # as the system
    path = tmp_path / "queried.yaml"
    path.write_text(SYSTEM % ", ".join(["7"] * 20_001), encoding="utf-8")
    with running(tmp_path / "log", str(path)) as system:
        system.wait_for("2 of 2 nodes active")
        wait_until(lambda: local_parameters("small", LIMIT_S), "an answer")
        small = local_parameters("/small", LIMIT_S)
        assert small is not None
        assert small.values(["numbers", "limit"]) == {"numbers": [1, 2], "limit": 1.5}
        assert [item.type for item in small.describe(["limit"])] == ["double"]
        assert local_parameters("/large", LIMIT_S) is None
        assert local_parameters("/unknown", LIMIT_S) is None
