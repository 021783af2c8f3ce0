"""Commands that need a system without errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.compose import compose

#: With their exit codes for other files.
COMMANDS = [
    ("diff", 1),
    ("doctor", 1),
    ("export launch", 1),
    ("dashboard", 1),
    ("run --dry-run", 78),
    ("hosts discovery-server", 78),
]


@pytest.mark.parametrize(("command", "code"), COMMANDS)
def test_a_file_with_errors_or_of_a_node_type_is_rejected(
    command: str, code: int, tmp_path: Path
) -> None:
    if command == "dashboard":
        pytest.importorskip("starlette", reason="the extra 'dashboard' is not installed")
    path = tmp_path / "broken.yaml"
    path.write_text("system: broken\nnodes:\n  one: {lifecycle: {depends_on: [two]}}\n")
    done = compose(*command.split(), str(path))
    assert (done.code, done.out) == (code, "")
    assert done.err.startswith("error[")
    done = compose(*command.split(), "nodes/relay.yaml")
    assert (done.code, done.out) == (code, "")
    assert "'nodes/relay.yaml' is a node type, not a system" in done.err
