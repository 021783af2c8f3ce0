"""Interface packages for colcon, where pip has not installed ROS 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.cli.commands import interface
from tests.cli.compose import compose


def test_packages_for_colcon_need_no_wheels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(interface, "wheel_versions", dict)
    assert compose("new", "interfaces", "my_msgs").code == 0
    status = tmp_path / "interfaces" / "my_msgs" / "msg" / "Status.msg"
    status.write_text("geometry_msgs/Pose pose\n")
    done = compose("interface", "build")
    assert done.code == 1
    assert "uses types of 'geometry_msgs', which pip has not installed" in done.err
    assert "compose interface build my_msgs --generate FOLDER" in done.err
    done = compose("interface", "build", "my_msgs", "--generate", "generated")
    assert (done.code, done.out) == (0, "my_msgs: generated\n")
    assert (tmp_path / "generated" / "CMakeLists.txt").is_file()
    assert not (tmp_path / "generated" / "pyproject.toml").exists()

    done = compose("interface", "build", "my_msgs", "--generate", "generated")
    assert "'generated' exists already" in done.err
    status.write_text("strng text\n")
    done = compose("interface", "build")
    assert "'strng' is neither a primitive type nor a message" in done.err
    assert "Status.msg:1:1\n" in done.err


def test_definitions_are_checked_before_anything_is_built(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "composer.yaml").write_text("interfaces: [interfaces]\n")
    for name, definition in (("my_msgs", "Header header"), ("good_msgs", "float32 speed")):
        package = tmp_path / "interfaces" / name
        (package / "msg").mkdir(parents=True)
        (package / "package.xml").write_text(f"<package><name>{name}</name></package>\n")
        (package / "msg" / "Speed.msg").write_text(f"{definition}\n")
    done = compose("interface", "build")
    assert (done.code, done.out) == (1, "")
    assert "interfaces/my_msgs/msg/Speed.msg:1:1\n" in done.err
    assert "did you mean 'std_msgs/Header'?" in done.err
    assert not (tmp_path / "build").exists()
    done = compose("interface", "build", "good_msgs", "--generate", "complete")
    assert (done.code, done.out) == (0, "good_msgs: complete\n")
