"""Programs that are measured side by side: at work in their turns alone, and gone afterwards."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import pytest

from benchmarks.held import Held
from benchmarks.processes import ProgramFailed
from tests.ros.support.loops import wait_until

RING = ("bare_outside", "none", "--shape", "ring", "--nodes", "2", "--seconds", "1")
BOTH = tuple((*RING, "--part", part) for part in "01")
STOPPED = "T"

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(60)]


def states_of_children() -> dict[int, str]:
    """Return the scheduler's state of each process that this one has started and that is there.

    See proc_pid_stat(5); any process may end between two looks.
    """
    states = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        with suppress(FileNotFoundError, ProcessLookupError):
            state, parent = file.read_text().rpartition(")")[2].split()[:2]
            if int(parent) == os.getpid():
                states[int(file.parent.name)] = state
    return states


def test_programs_work_in_their_turns_alone() -> None:
    before = states_of_children().keys()

    def states() -> list[str]:
        return [state for process, state in states_of_children().items() if process not in before]

    with Held(BOTH, os.environ, timeout_s=20.0) as held:
        wait_until(lambda: states() == [STOPPED, STOPPED], "both stopped")
        held.work(0.1)
        wait_until(lambda: states() == [STOPPED, STOPPED], "both stopped again")
        result = held.result()
    assert result["delivered"] > 0
    assert not states()


@pytest.mark.parametrize(
    ("parts", "timeout_s", "said"),
    [
        pytest.param(BOTH, 0.01, "nothing begun within 0.01 s", id="late"),
        pytest.param(
            [("bare", "none", "--shape", "bow")], 20.0, "exit code 2: .*invalid choice", id="bad"
        ),
    ],
)
def test_programs_that_do_not_begin_are_told_and_gone(
    parts: tuple[tuple[str, ...], ...], timeout_s: float, said: str
) -> None:
    before = states_of_children().keys()
    with pytest.raises(ProgramFailed, match=said), Held(parts, os.environ, timeout_s):
        pytest.fail("has begun")
    assert states_of_children().keys() == before
