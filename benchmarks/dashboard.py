"""What the dashboard costs the system that it shows.

Two equal systems run at the same time in two ROS domains, one of them with a dashboard, so that
other load of the machine affects both.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING

from benchmarks.figures import Row
from benchmarks.pipeline import COMPOSED, Side, cpu_s, running
from benchmarks.processes import ROOT, ProgramFailed, environment

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection, connect

IDLE = "pipeline.yaml, dashboard without a browser"
WATCHED = "pipeline.yaml, graph in one browser"
STALLED = "timer callback, image client that reads nothing"
WITHOUT = "the same without a dashboard"
UNWATCHED = "the same without a client"
_URL = re.compile(rb"http://([\d.]+:(\d+))/\?token=([\w-]+)")
_TIMEOUT_S = 30.0
#: After the first view, the dashboard looks for new nodes more often.
_SETTLE_S = 5.0
_P99 = re.compile(r"p99 ([\d.]+) us")
_CAMERA = """\
system: measured
nodes:
  camera:
    behavior: measured:Camera
    publishers: {image: {type: sensor_msgs/msg/Image, topic: /image, qos: sensor_data}}
    timers: {frame: {period_ms: 33.3}, work: {period_ms: 5}}
"""
_BEHAVIOR = """\
import time
from array import array

from composer.behavior import Behavior
from sensor_msgs.msg import Image


class Camera(Behavior):
    def on_activate(self):
        self.took_ns = []
        self.picture = Image(width=640, height=480, encoding="rgb8", step=1920)
        self.picture.data = array("B", bytes(640 * 480 * 3))

    def on_frame(self):
        self.publishers.image.publish(self.picture)

    def on_work(self):
        began_ns = time.perf_counter_ns()
        sum(range(20_000))
        self.took_ns.append(time.perf_counter_ns() - began_ns)

    def on_deactivate(self):
        took_ns = sorted(self.took_ns)
        self.log.info(f"p99 {took_ns[len(took_ns) * 99 // 100] / 1000} us")
"""


def measure(*, long: bool) -> list[Row]:
    """Measure all rows. Raises ProgramFailed."""
    rounds, seconds = (8, 20.0) if long else (4, 6.0)
    idle, watched, stalled = [], [], []
    for turn in range(rounds):
        idle.append(_cpu(seconds, is_watched=False))
        watched.append(_cpu(seconds, is_watched=True))
        stalled.append(_percentiles(seconds, shown=turn % 2))
    return [
        _row(IDLE, "CPU ms/s", WITHOUT, idle),
        _row(WATCHED, "CPU ms/s", WITHOUT, watched),
        _row(STALLED, "p99 us", UNWATCHED, stalled),
    ]


def _row(case: str, unit: str, baseline: str, pairs: list[tuple[float, float]]) -> Row:
    return Row(case, unit, baseline, tuple(a for a, _ in pairs), tuple(b for _, b in pairs))


def _cpu(seconds: float, *, is_watched: bool) -> tuple[float, float]:
    """Return the CPU usage of system and dashboard, and that of the system alone, in ms/s."""
    with ExitStack() as stack:
        shown_variables = environment()
        shown, _ = stack.enter_context(running(COMPOSED, shown_variables))
        alone, _ = stack.enter_context(running(COMPOSED, environment()))
        dashboard, address = stack.enter_context(
            _dashboard(shown_variables, "systems/pipeline.yaml")
        )
        if is_watched:
            browser = stack.enter_context(_connected(address))
            for number, channel in enumerate(("graph", "graph.live")):
                _subscribe(browser, number, channel, {})
            threading.Thread(target=_read_all, args=(browser,), daemon=True).start()
        time.sleep(_SETTLE_S)
        processes = (shown.pid, dashboard.pid, alone.pid)
        before_s, began_s = tuple(map(cpu_s, processes)), time.perf_counter()
        time.sleep(seconds)
        passed_s = time.perf_counter() - began_s
        used = [
            1000.0 * (cpu_s(pid) - earlier_s) / passed_s
            for pid, earlier_s in zip(processes, before_s, strict=True)
        ]
        return used[0] + used[1], used[2]


def _percentiles(seconds: float, *, shown: int) -> tuple[float, float]:
    """Return the 99th percentiles of the system with a client that reads nothing, and of one alone.

    In microseconds. ``shown`` is the number of the system with the client: the one that starts
    first has a small advantage.
    """
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        file = Path(folder, "measured.yaml")
        file.write_text(_CAMERA, encoding="utf-8")
        Path(folder, "measured.py").write_text(_BEHAVIOR, encoding="utf-8")
        side = Side(("-m", "composer", "run", str(file)), "1 of 1 nodes active", _P99)
        variables = (environment(), environment())
        systems = [stack.enter_context(running(side, used)) for used in variables]
        _, address = stack.enter_context(_dashboard(variables[shown], str(file)))
        browser = stack.enter_context(_connected(address))
        _subscribe(browser, 0, "image", {"topic": "/image", "max_hz": 15})
        time.sleep(seconds)
        for process, _ in systems:
            process.send_signal(signal.SIGINT)
        for process, _ in systems:
            process.wait(_TIMEOUT_S)
        reported = [_reported(output) for _, output in systems]
        return reported[shown], reported[1 - shown]


def _reported(output: IO[bytes]) -> float:
    output.seek(0)
    found = _P99.search(output.read().decode(errors="replace"))
    if found is None:
        raise ProgramFailed("the measured system has not reported a percentile")
    return float(found[1])


@contextmanager
def _dashboard(
    variables: Mapping[str, str], file: str
) -> Iterator[tuple[subprocess.Popen[bytes], re.Match[bytes]]]:
    """Context manager: run a dashboard, and yield it with its address."""
    command = [sys.executable, "-m", "composer", "dashboard", file, "--port", "0"]
    with subprocess.Popen(command, cwd=ROOT, env=variables, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            address = _URL.match(process.stdout.readline())
            if address is None:
                raise ProgramFailed("the dashboard has not started")
            yield process, address
        finally:
            process.kill()


def _connected(address: re.Match[bytes]) -> connect:
    """Return the connection of a browser, for a ``with`` block."""
    host, port, token = (part.decode() for part in address.groups())
    # An extra, which the targets do without.
    from websockets.sync.client import connect  # noqa: PLC0415

    return connect(
        f"ws://{host}/ws",
        origin=f"http://{host}",
        additional_headers={"Cookie": f"compose_dashboard_{port}={token}"},
        compression=None,
        max_size=None,
    )


def _subscribe(
    browser: ClientConnection, number: int, channel: str, parameters: dict[str, object]
) -> None:
    request = {"id": number, "op": "subscribe", "channel": channel, "params": parameters}
    browser.send(json.dumps(request))


def _read_all(browser: ClientConnection) -> None:
    for _ in browser:
        pass
