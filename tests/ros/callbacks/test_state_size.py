"""State variables cannot use up the memory."""

from __future__ import annotations

from pathlib import Path

from tests.ros.support.in_process import running

SYSTEM = """
system: growing
nodes:
  growing:
    state: {text: abcdefgh, list: [1, [2, 3]]}
    timers:
      text: {period_ms: 20, set: {text: "{state.text}{state.text}"}}
      list: {period_ms: 20, set: {list: ["{state.list}", "{state.list}"]}}
      whole: {period_ms: 20, set: {text: "{state.text}"}, log: "length {len(state.text)}"}
"""


def test_a_state_that_grows_without_end_is_an_error(tmp_path: Path) -> None:
    with running(SYSTEM, tmp_path) as system:
        text = system.wait_for_log("'set' of 'text'")
        system.wait_for_log("'set' of 'list'")
        system.wait_for_log("length 524288")  # the last value is kept, and other timers run
    assert "the value has more than 1000000 characters and items" in text
    assert system.end().exit_code == 0
