"""Files that belong to another user: every command says which one it cannot read."""

from __future__ import annotations

import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from composer.client.run_log.reading import Record
from tests.cli.compose import Done, compose, write_files

#: In folders that only root can enter, the other user could not run any command.
PRIVATE = [
    folder
    for path in (Path(sys.prefix), Path(__file__))
    for folder in path.resolve().parents
    if not folder.stat().st_mode & stat.S_IXOTH
]
pytestmark = [
    pytest.mark.skipif(os.geteuid() != 0, reason="only root can change owners"),
    pytest.mark.skipif(bool(PRIVATE), reason=f"only root can enter {PRIVATE}"),
]

OTHER_USER = 65534
RUN = "log/compose/robot/2026-03-01-08-30-00-000-1"
RECORD = Record(1, "info", "arm", "/arm", "moved").to_line()
FILES = {
    "composer.yaml": "",
    "systems/robot.yaml": (
        "system: robot\nparameter_files: [../arm.params.yaml]\nnodes: {arm: {type: arm}}\n"
    ),
    "nodes/arm.yaml": (
        "node: arm\nbehavior: arm:Arm\nparameters: {speed: {type: double, default: 1.0}}\n"
    ),
    "nodes/arm.py": "class Arm:\n    def on_activate(self): pass\n",
    "arm.params.yaml": "arm: {ros__parameters: {speed: 2.0}}\n",
    f"{RUN}/run.json": '{"system": "/robot", "host": "here", "pid": 1}\n',
    f"{RUN}/log-000001.jsonl": RECORD,
}
VALIDATE = ("validate", "systems", "nodes")


def make_project() -> Path:
    path = Path(tempfile.mkdtemp())
    path.chmod(0o755)
    write_files(FILES, path)
    return path


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A project and a log that every user can read, unlike the folders of pytest."""
    path = make_project()
    monkeypatch.chdir(path)
    monkeypatch.setenv("ROS_LOG_DIR", str(path / "log"))
    yield path
    shutil.rmtree(path)


@cache
def import_modules_of(*words: str) -> None:
    """Run a command in another project."""
    folder = Path.cwd()
    other = make_project()
    os.chdir(other)
    compose(*words)
    os.chdir(folder)
    shutil.rmtree(other)


def compose_as_other(*words: str) -> Done:
    """Run a command as a user who owns nothing here, and could not import its modules."""
    import_modules_of(*words)
    os.seteuid(OTHER_USER)
    try:
        return compose(*words)
    finally:
        os.seteuid(0)


@pytest.mark.parametrize(
    ("private", "words", "name"),
    [
        ("systems/robot.yaml", VALIDATE, ""),
        ("nodes/arm.yaml", VALIDATE, ""),
        ("nodes/arm.py", VALIDATE, "module 'arm'"),
        ("arm.params.yaml", VALIDATE, ""),
        ("composer.yaml", VALIDATE, ""),
        ("systems", VALIDATE, ""),
        ("nodes", VALIDATE, ""),
        ("systems/robot.yaml", ("graph", "systems/robot.yaml"), ""),
        ("systems/robot.yaml", ("config", "systems/robot.yaml"), ""),
        ("systems/robot.yaml", ("export", "sros2", "systems/robot.yaml"), ""),
        (f"{RUN}/log-000001.jsonl", ("logs",), ""),
    ],
)
def test_a_private_file_is_named(
    private: str, words: tuple[str, ...], name: str, folder: Path
) -> None:
    path = folder / private
    path.chmod(0o700 if path.is_dir() else 0o600)
    done = compose_as_other(*words)
    output = done.out + done.err
    assert done.code == 1, output
    assert (name or private) in output
    assert "ermission denied" in output


@pytest.mark.parametrize("private", ["log/compose", "log/compose/robot", RUN, f"{RUN}/run.json"])
def test_a_private_run_is_skipped(private: str, folder: Path) -> None:
    path = folder / private
    path.chmod(0o700 if path.is_dir() else 0o600)
    for words in (("logs",), ("logs", "--list")):
        done = compose_as_other(*words)
        assert done.code in (0, 1), done.err
        assert "Traceback" not in done.err


def test_files_of_others_that_root_reads(folder: Path) -> None:
    for path in folder.rglob("*"):
        os.chown(path, OTHER_USER, OTHER_USER, follow_symlinks=False)
    assert compose(*VALIDATE).code == 0
    assert "moved" in compose("logs").out
