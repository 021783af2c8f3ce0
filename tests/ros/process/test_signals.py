"""Signals at random moments in the life of the pipeline."""

from __future__ import annotations

import os
import random
import re
import signal
import time
from pathlib import Path

import pytest

from tests.ros.process.test_restarts import children
from tests.ros.support.in_process import end_limit_s
from tests.ros.support.system_process import RunningSystem

#: The lines that start each part of the pipeline's life.
MOMENTS = ("inactive$", "sensor_simulator active$", "3 of 3 nodes active")
#: The order of the tear-down.
ORDER = ("/control/motor_controller", "/planning/planner", "/perception/sensor_simulator")


def end_at(moment: str, delay_s: float, number: signal.Signals) -> float:
    """Run the pipeline, send a signal ``delay_s`` after a moment of its life.

    Check that the end is in time and in order and leaves no processes; return how long it took.
    """
    with RunningSystem("systems/pipeline.yaml", "--for", "30") as system:
        system.wait_for(moment)
        time.sleep(delay_s)
        _, *left = children(system.process.pid)
        sent_s = time.monotonic()
        os.kill(system.process.pid, number)
        code = system.process.wait(timeout=60.0)
        took_s = time.monotonic() - sent_s
    case = f"{number.name} {1000.0 * delay_s:.0f} ms after '{moment}'\n{system.output}"
    assert code == 0, case
    assert took_s < end_limit_s(), case
    assert "Traceback" not in system.output, case
    for state in ("inactive", "unconfigured", "finalized"):
        check_order(system.lines, state, case)
    assert not [pid for pid in left if Path("/proc", str(pid)).exists()], case
    return took_s


def check_order(lines: list[str], state: str, case: str) -> None:
    """Check that the tear-down follows the order of the dependencies."""
    stopping = next(place for place, line in enumerate(lines) if "shutting down:" in line)
    down = [
        found[1] for line in lines[stopping:] if (found := re.search(rf"\] (/\S+) {state}$", line))
    ]
    assert down == [node for node in ORDER if node in down], case
    if state == "finalized":
        assert len(down) == len(ORDER), case


@pytest.mark.parametrize(
    "times",
    [1, pytest.param(17, marks=[pytest.mark.soak, pytest.mark.timeout(1800)])],
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_at_a_random_moment_ends_everything(number: signal.Signals, times: int) -> None:
    seed = random.randrange(2**32)
    chance = random.Random(seed)
    took_s = [
        end_at(moment, chance.uniform(0.0, 0.4), number) for _ in range(times) for moment in MOMENTS
    ]
    print(f"{number.name}: {len(took_s)} ends, seed {seed}, longest {max(took_s):.2f} s")
