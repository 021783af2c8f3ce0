"""Errors of the commands for other computers, before they connect."""

from __future__ import annotations

import importlib.util
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.cli.compose import compose, refused

SYSTEM = """\
system: robot
hosts:
  jetson: {address: 192.0.2.1HOST}
processes: {vision: {nodes: [camera], host: jetson}}
nodes:
  camera: {on_activate: {log: started}}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "robot.yaml"


@pytest.mark.parametrize("command", ["run", "sync"])
def test_the_extra_is_named_if_it_is_missing(
    command: str, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        "composer.cli.support.errors.find_spec",
        lambda name: None if name == "asyncssh" else find(name),
    )
    message = refused(1, "hosts", command, str(path))
    assert "needs asyncssh, which this Python does not have" in message
    assert 'pip install "ros2-composer[hosts]"' in message


@pytest.mark.parametrize(
    ("text", "words", "error"),
    [
        (SYSTEM.replace("HOST", ""), (), "robot.yaml:3:3: host 'jetson' has no workspace"),
        ("system: robot\nnodes: {a: {on_activate: {log: on}}}\n", (), "has no 'hosts'"),
        (
            SYSTEM.replace("HOST", ", workspace: ~/robot"),
            ("--host", "jetsn"),
            "did you mean 'jetson'?",
        ),
        (
            SYSTEM.replace("HOST", ", workspace: ~/robot, identity_file: lost"),
            (),
            "jetson (192.0.2.1): there is no file 'lost'",
        ),
        (SYSTEM.replace("192.0.2.1HOST", "127.0.0.1"), (), "are this computer"),
    ],
)
def test_what_keeps_a_project_from_being_copied(
    path: Path, text: str, words: tuple[str, ...], error: str
) -> None:
    pytest.importorskip("asyncssh", reason="asyncssh is not installed")
    if shutil.which("rsync") is None or shutil.which("ssh") is None:
        pytest.skip("rsync or ssh is not installed")
    path.write_text(text, encoding="utf-8")
    with ThreadPoolExecutor() as threads:  # the main one may have the event loop of a browser test
        done = threads.submit(compose, "hosts", "sync", str(path), *words).result()
    assert done.code in (1, 2)
    assert error in done.err
