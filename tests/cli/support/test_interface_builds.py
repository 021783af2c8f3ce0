"""Interface packages for colcon, where pip has not installed ROS 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.cli.support import interface_builds
from tests.cli.compose import compose


def test_packages_for_colcon_need_no_wheels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(interface_builds, "wheel_versions", dict)
    assert compose("new", "interfaces", "my_msgs").code == 0
    status = tmp_path / "interfaces" / "my_msgs" / "msg" / "Status.msg"
    status.write_text("geometry_msgs/Pose pose\n")
    done = compose("interfaces", "build")
    assert done.code == 1
    assert "uses types of 'geometry_msgs', which pip has not installed" in done.err
    assert "compose interfaces build my_msgs --generate FOLDER" in done.err
    done = compose("interfaces", "build", "my_msgs", "--generate", "generated")
    assert (done.code, done.out) == (0, "my_msgs: generated\n")
    assert (tmp_path / "generated" / "CMakeLists.txt").is_file()
    assert not (tmp_path / "generated" / "pyproject.toml").exists()

    done = compose("interfaces", "build", "my_msgs", "--generate", "generated")
    assert "'generated' exists already" in done.err
    status.write_text("strng text\n")
    done = compose("interfaces", "build")
    assert done.err.endswith("Status.msg:1: 'strng' is neither a primitive type nor a message\n")
