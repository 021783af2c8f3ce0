"""``compose stubs``: what it writes, replaces, removes and keeps."""

from __future__ import annotations

import ast
import errno
import os
import tempfile
from pathlib import Path

import pytest

from composer.python_code.stubs.folder import HEADER
from tests.cli.compose import compose, refused, run_python, write_files

TYPED = "typings/composer/typed.pyi"
#: A system with a node that has a behavior and ports of its own.
SYSTEM = """\
system: extra
nodes:
  filter_node:
    behavior: filter_node:Filter
    subscriptions: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}}
"""


def contents(folder: Path) -> dict[str, bytes]:
    """Return the files below a folder, with their contents."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def change(path: Path, before: str, after: str) -> None:
    path.write_text(path.read_text().replace(before, after, 1))


def classes(project: Path) -> list[str]:
    """Return the base classes of behaviors in the stub."""
    tree = ast.parse((project / TYPED).read_text())
    names = (node.name for node in tree.body if isinstance(node, ast.ClassDef))
    return [name for name in names if name.endswith("Behavior")]


def test_stubs_of_the_project_are_written_and_are_up_to_date(project: Path) -> None:
    (project / "systems/extra.yaml").write_text(SYSTEM)
    code = (project / "nodes/counter.py").read_text()
    assert "from composer.typed import CounterBehavior" in code
    done = compose("stubs")
    assert (done.code, done.out) == (0, "")
    assert "'typings': " in done.err
    assert " files written" in done.err
    assert classes(project) == ["CounterBehavior", "FilterNodeBehavior"]
    files = contents(project / "typings")
    assert {"std_msgs/msg.pyi", "std_srvs/srv.pyi", "rclpy/node.pyi"} <= files.keys()
    for name, text in files.items():
        assert text.startswith(HEADER.encode()), name
        ast.parse(text)
    assert compose("stubs", "--check").code == 0
    assert compose("stubs").err == "'typings' is up to date\n"


def test_the_output_depends_on_the_given_files_only(project: Path) -> None:
    (project / "systems/extra.yaml").write_text(SYSTEM)
    done = compose("stubs", "systems/my_robot.yaml", "-o", "elsewhere")
    assert done.code == 0, done.err
    assert not (project / "typings").exists()
    (project / "elsewhere").rename(project / "typings")
    assert classes(project) == ["CounterBehavior"]
    written = []
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        done = run_python("-P", "-m", "composer", "stubs", "-o", seed, env=environment)
        assert done.returncode == 0, done.stderr
        written.append(contents(project / seed))
    assert written[0] == written[1]


def test_check_names_what_would_change(project: Path) -> None:
    assert compose("stubs").code == 0
    before = contents(project / "typings")
    change(project / "nodes/counter.yaml", "rate_hz:", "rate:")
    done = compose("stubs", "--check")
    assert (done.code, done.out) == (1, f"{TYPED}\n")
    assert "'typings' is out of date" in done.err
    assert contents(project / "typings") == before
    done = compose("stubs", "-o", "other", "--check")
    assert done.code == 1
    assert not (project / "other").exists()


def test_only_files_of_the_command_are_replaced_and_removed(project: Path) -> None:
    assert compose("stubs").code == 0
    kept = {
        "mine.pyi": "X: int\n",
        "std_msgs/extra.pyi": "Y: int\n",
        "rclpy/node.pyi": "class Node: ...\n",
    }
    others = {"old_msgs/msg.pyi": HEADER, "std_msgs/msg.pyi": f"{HEADER}changed\n"}
    write_files({**kept, **others}, project / "typings")
    done = compose("stubs")
    assert "note: 'typings/rclpy/node.pyi' is not a file of this command: it is kept" in done.err
    assert "'typings': 1 file written, 1 removed" in done.err
    files = contents(project / "typings")
    assert {name: files[name].decode() for name in kept} == kept
    assert not (project / "typings/old_msgs").exists()
    assert b"changed" not in files["std_msgs/msg.pyi"]
    assert compose("stubs", "--check").code == 0


def test_symbolic_links_are_not_followed(project: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    write_files({"std_msgs/old.pyi": HEADER, "file.pyi": HEADER}, outside)
    before = contents(outside)
    folder = project / "typings"
    (folder / "rclpy").mkdir(parents=True)
    (folder / "std_msgs").symlink_to(outside / "std_msgs")
    (folder / "rclpy/node.pyi").symlink_to(outside / "file.pyi")
    (folder / "stale.pyi").symlink_to(outside / "file.pyi")
    done = compose("stubs")
    assert done.code == 0, done.err
    assert "'typings/std_msgs/msg.pyi' is not a file of this command: it is kept" in done.err
    assert contents(outside) == before
    assert (folder / "stale.pyi").is_symlink()


def test_a_node_type_with_errors_is_written_as_far_as_it_is_known(project: Path) -> None:
    (project / "nodes/arm.yaml").write_text(
        "node: arm\nbehavior: arm:Arm\npublishers:\n  joints: {type: sensor_msgs/msg/JointState}\n"
        "  tool: {type: sensor_msgs/msg/Nonsense}\n  class: {type: std_msgs/msg/String}\n"
        "parameters:\n  gain: {type: dubble}\n  rate.max: {type: double}\nunknown: 1\n"
    )
    (project / "nodes/broken.yaml").write_text("node: [\n")
    done = compose("stubs")
    assert done.code == 0
    assert "note: 'nodes/broken.yaml' cannot be read: see 'compose validate'" in done.err
    text = (project / TYPED).read_text()
    ast.parse(text)
    assert "def joints(self) -> composer.behavior.Publisher[sensor_msgs.msg.JointState]" in text
    assert "def tool(self) -> Any" in text
    assert "name: Literal['rate.max'], /) -> float" in text


def test_of_two_nodes_with_one_class_name_the_first_is_written(project: Path) -> None:
    (project / "systems/extra.yaml").write_text(SYSTEM.replace("filter_node:\n", "counter:\n"))
    done = compose("stubs")
    assert (
        "note: 'counter' of 'systems/extra.yaml' differs from 'counter' of 'nodes/counter.yaml', "
        "which has the class of that name" in done.err
    )
    assert "on_scan" not in (project / TYPED).read_text()


@pytest.mark.parametrize("command", [("validate", "nodes"), ("run", "my_robot", "--dry-run")])
def test_validate_and_run_update_the_folder(project: Path, command: tuple[str, ...]) -> None:
    (project / "systems/extra.yaml").write_text(SYSTEM)
    (project / "nodes/filter_node.py").write_text(
        "class Filter:\n    def on_scan(self, message): ...\n"
    )
    assert "typings" not in compose(*command).err
    assert not (project / "typings").exists()
    assert compose("stubs").code == 0
    assert "typings" not in compose(*command).err
    more = "  more: {type: std_msgs/msg/Bool, external: true}\ntimers:"
    change(project / "nodes/counter.yaml", "timers:", more)
    done = compose(*command)
    assert "'typings' is up to date again: 1 file written" in done.err
    assert "def more(self)" in (project / TYPED).read_text()
    assert classes(project) == ["CounterBehavior", "FilterNodeBehavior"]
    assert compose("stubs", "--check").code == 0


def test_a_folder_is_left_alone_without_stubs_or_while_a_node_type_cannot_be_read(
    project: Path,
) -> None:
    write_files({TYPED: "class CounterBehavior: ...\n"})
    assert "typings" not in compose("validate", ".").err
    assert contents(project / "typings") == {"composer/typed.pyi": b"class CounterBehavior: ...\n"}
    (project / TYPED).unlink()
    assert compose("stubs").code == 0
    (project / "nodes/counter.yaml").write_text("node: [\n")
    done = compose("validate", ".")
    assert done.code == 1
    assert "typings" not in done.err
    assert classes(project) == ["CounterBehavior"]


def test_a_folder_that_cannot_be_written_is_one_note(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(**_: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    assert compose("stubs").code == 0
    (project / TYPED).write_text(HEADER)
    monkeypatch.setattr(tempfile, "mkstemp", refuse)
    done = compose("validate", ".")
    assert done.code == 0
    note = f"note: 'typings' was not updated: cannot write '{project / TYPED}': "
    assert f"{note}Read-only file system" in done.err.splitlines()
    assert (compose("stubs").code, (project / TYPED).read_text()) == (1, HEADER)


def test_what_the_command_cannot_use_is_an_error(
    project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for words in (["nowhere"], ["a" * 5000], ["systems", str(tmp_path)]):
        assert compose("stubs", *words).code == 2
    (project / "typings").write_text("")
    message = refused(1, "stubs")
    assert "typings" in message
    assert "internal error" not in message
    monkeypatch.chdir(tmp_path)
    assert "there is no system and no node type" in refused(2, "stubs")
    assert not (tmp_path / "typings").exists()


@pytest.mark.parametrize("line", ["CounterBehavior", "CounterBehavior as Base", "OtherBehavior"])
def test_a_missing_handler_of_a_typed_behavior_is_reported(project: Path, line: str) -> None:
    base = line.rpartition(" ")[2]
    (project / "nodes/counter.py").write_text(
        f"from composer.typed import {line}\n\n\nclass Counter({base}):\n    pass\n"
    )
    done = compose("validate", "nodes")
    assert (done.code, done.out.count("error[")) == (1, 1)
    assert "error[RC433 missing-handler]: timer 'tick' has no handler" in done.out
