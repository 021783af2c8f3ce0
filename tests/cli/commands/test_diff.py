from __future__ import annotations

from pathlib import Path

from tests.cli.compose import compose


def test_an_unknown_system_is_a_usage_error_with_a_suggestion() -> None:
    done = compose("diff", "pipelin")
    assert (done.code, done.out) == (2, "")
    assert "did you mean 'pipeline'?" in done.err


def test_a_system_with_errors_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text("system: broken\nnodes:\n  one: {lifecycle: {depends_on: [two]}}\n")
    done = compose("diff", str(path))
    assert (done.code, done.out) == (1, "")
    assert "error[" in done.err
    assert "has errors, so it cannot be compared" in done.err


def test_a_node_type_is_rejected() -> None:
    done = compose("diff", "nodes/relay.yaml")
    assert (done.code, done.out) == (1, "")
    assert "is a node type, not a system" in done.err
