"""``compose new`` and ``compose import`` create valid files."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.cli.commands.import_nodes import why_too_large
from tests.cli.compose import compose, refused, write_files

_SUFFIXES = (".yaml", ".py", ".xml", ".md", ".msg")


def test_a_project_and_what_is_added_to_it_are_valid(project: Path) -> None:
    assert compose("validate", "--strict", ".").code == 0
    for kind, name in (("system", "arm"), ("node", "gripper"), ("interfaces", "my_msgs")):
        done = compose("new", kind, name)
        assert done.code == 0, done.err
        for path in done.out.splitlines():
            assert (project / path).is_file()
    done = compose("validate", "--strict", ".")
    assert done.code == 0, done.out
    assert "my_msgs/msg/Status" in compose("interface", "list").out
    texts = [path.read_text() for path in project.rglob("*") if path.suffix in _SUFFIXES]
    assert not [text for text in texts if "@name@" in text or "@class@" in text]


def test_files_are_not_replaced(project: Path) -> None:
    before = (project / "nodes" / "counter.py").read_text()
    assert "counter.yaml' exists already" in refused(1, "new", "node", "counter")
    assert (project / "nodes" / "counter.py").read_text() == before
    (project / "systems" / "arm.yaml").touch()
    assert compose("new", "system", "arm").code == 1
    assert not (project / "tests" / "test_arm.py").exists()


@pytest.mark.parametrize(
    ("kind", "message", "names"),
    [
        ("node", "", ("My", "9lives", "a-b", "a__b", "a/b", "", "composer", "class")),
        ("interfaces", " is in use", ("my_robot", "sensor_msgs", "class")),
    ],
)
def test_names_that_ros_or_python_do_not_accept_are_refused(
    kind: str, message: str, names: tuple[str, ...], project: Path
) -> None:
    before = set(project.rglob("*"))
    for name in names:
        assert f"'{name}'{message}" in refused(2, "new", kind, name)
    assert set(project.rglob("*")) == before


def test_a_node_type_that_replaces_a_built_in_one_is_noted(project: Path) -> None:
    note = "note: it replaces the built-in node type 'filter'"
    assert note in compose("new", "node", "filter").err


def test_a_file_that_would_not_be_valid_is_refused_or_noted(folder: Path) -> None:
    write_files({"driver.py": "from rclpy.node import Node\nclass Driver(Node):\n    pass\n"})
    message = refused(2, "import", "class", "driver:Driver", "-o", "my driver.yaml")
    assert "the name 'my driver' contains a space" in message
    assert [path.name for path in folder.iterdir()] == ["driver.py"]
    note = "note: the module 'driver' is not found from other/driver.yaml: move it next to"
    assert note in compose("import", "class", "driver:Driver", "-o", "other/driver.yaml").err
    done = compose("import", "class", "driver:Driver", "-o", "driver.yaml")
    assert done.err == "wrote driver.yaml\n"


@pytest.mark.parametrize(
    ("count", "value", "problem"),
    [
        (5_000, "1.0", None),
        (5_001, "1.0", "'parameters' has more than 5,000 entries"),
        (300, "x" * 9_000, "this file is larger than 2,000,000 bytes"),
    ],
)
def test_what_validate_would_refuse_is_not_written(
    count: int, value: str, problem: str | None
) -> None:
    parameters = "".join(f"      p{number}: {value}\n" for number in range(count))
    text = f"system: s\nnodes:\n  a:\n    external: true\n    parameters:\n{parameters}"
    assert why_too_large(text) == problem
