from __future__ import annotations

from tests.cli.compose import compose


def test_an_unknown_system_is_a_usage_error_with_a_suggestion() -> None:
    done = compose("diff", "pipelin")
    assert (done.code, done.out) == (2, "")
    assert "did you mean 'pipeline'?" in done.err
