"""``compose import`` writes no file that would not be valid."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.cli.commands.import_nodes import why_too_large
from tests.cli.compose import compose, write_files


def test_a_file_that_would_not_be_valid_is_refused_or_noted(folder: Path) -> None:
    write_files({"driver.py": "from rclpy.node import Node\nclass Driver(Node):\n    pass\n"})
    for arguments in (
        ("class", "driver:Driver", "-o", "my driver.yaml"),
        ("live", "--system", "my driver"),
    ):
        done = compose("import", *arguments)
        assert (done.code, done.out) == (2, "")
        assert "the name 'my driver' contains a space" in done.err
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
