"""What the dashboard costs the system that it shows.

Each row compares time slices with and without the dashboard within one run, since two runs of the
same program differ by more than what is measured. How long a slice is, how many there are, and
what is computed from them was decided before the first measurement: see README.md.
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
from typing import TYPE_CHECKING

from benchmarks.figures import Row, percentile
from benchmarks.pipeline import COMPOSED, Side, cpu_s, running
from benchmarks.processes import ROOT, ProgramFailed, environment

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection, connect

IDLE = "pipeline.yaml, dashboard without a browser"
WATCHED = "pipeline.yaml, graph in one browser"
STALLED = "timer callback, image client that reads nothing"
WITHOUT = "the same without a dashboard"
UNWATCHED = "the same without a client"
_URL = re.compile(rb"http://([\d.]+:\d+)/\?token=([\w-]+)")
_TIMEOUT_S = 30.0
_IDLE_SLICE_S, _IDLE_PAIRS = 2.0, (30, 100)
#: What the system needs alone differs by a factor of up to two between slices; see README.md.
_WATCHED_SLICE_S, _WATCHED_PAIRS = 12.0, (12, 30)
#: After the first view, the dashboard looks for new nodes more often; after the last one, it leaves
#: the ROS graph.
_SETTLE_S = 6.0
_STALLED_SLICE_S, _STALLED_PAIRS, _STALLED_RUNS = 2.5, 8, (4, 12)
#: Until the queues of a client that does not read are full.
_STALLED_SETTLE_S = 0.5
_CAMERA = """\
system: measured
nodes:
  camera:
    behavior: measured:Camera
    publishers: {image: {type: sensor_msgs/msg/Image, topic: /image, qos: sensor_data}}
    timers: {frame: {period_ms: 33.3}, work: {period_ms: 5}}
"""
_BEHAVIOR = """\
import json
import time
from array import array
from pathlib import Path

from composer.behavior import Behavior
from sensor_msgs.msg import Image


class Camera(Behavior):
    def on_activate(self):
        self.calls_ns = []
        self.picture = Image(width=640, height=480, encoding="rgb8", step=1920)
        self.picture.data = array("B", bytes(640 * 480 * 3))

    def on_frame(self):
        self.publishers.image.publish(self.picture)

    def on_work(self):
        began_ns = time.perf_counter_ns()
        sum(range(20_000))
        self.calls_ns.append((began_ns, time.perf_counter_ns() - began_ns))

    def on_deactivate(self):
        Path(__file__).with_name("calls.json").write_text(json.dumps(self.calls_ns))
"""


def measure(*, long: bool) -> list[Row]:
    """Measure all rows. Raises ProgramFailed."""
    index = 1 if long else 0
    return [
        _row(IDLE, "CPU ms/s", WITHOUT, _idle(_IDLE_PAIRS[index])),
        _row(WATCHED, "CPU ms/s", WITHOUT, _watched(_WATCHED_PAIRS[index])),
        _row(STALLED, "p99 us", UNWATCHED, [_stalled() for _ in range(_STALLED_RUNS[index])]),
    ]


def _row(case: str, unit: str, baseline: str, pairs: list[tuple[float, float]]) -> Row:
    return Row(case, unit, baseline, tuple(a for a, _ in pairs), tuple(b for _, b in pairs))


def _alternating(pairs: int) -> Iterator[bool]:
    """Yield whether the next slice is one with the dashboard: without, with, with, without, ..."""
    for pair in range(pairs):
        yield from (False, True) if pair % 2 == 0 else (True, False)


def _pairs_of(slices: list[tuple[bool, float]]) -> list[tuple[float, float]]:
    """Return the values with and without the dashboard of each two slices that follow another."""
    return [
        (dict(pair)[True], dict(pair)[False])
        for pair in zip(slices[::2], slices[1::2], strict=True)
    ]


def _idle(pairs: int) -> list[tuple[float, float]]:
    """Return the CPU usage with a dashboard that runs, and with one that is stopped, in ms/s."""
    variables = environment()
    with ExitStack() as stack:
        system, _ = stack.enter_context(running(COMPOSED, variables))
        dashboard, _ = stack.enter_context(running_dashboard(variables, "systems/pipeline.yaml"))
        time.sleep(_SETTLE_S)
        slices = []
        for runs in _alternating(pairs):
            dashboard.send_signal(signal.SIGCONT if runs else signal.SIGSTOP)
            slices.append((runs, _cpu_ms_per_s(_IDLE_SLICE_S, system.pid, dashboard.pid)))
        return _pairs_of(slices)


def _watched(pairs: int) -> list[tuple[float, float]]:
    """Return the CPU usage with the graph on the screen, and without a browser, in ms/s."""
    variables = environment()
    with ExitStack() as stack:
        system, _ = stack.enter_context(running(COMPOSED, variables))
        dashboard, address = stack.enter_context(
            running_dashboard(variables, "systems/pipeline.yaml")
        )
        slices = []
        for is_watched in _alternating(pairs):
            with ExitStack() as view:
                if is_watched:
                    browser = view.enter_context(_connected(address))
                    for number, channel in enumerate(("nodes", "graph", "graph.live")):
                        _subscribe(browser, number, channel, {})
                    threading.Thread(target=_read_all, args=(browser,), daemon=True).start()
                time.sleep(_SETTLE_S)
                used = _cpu_ms_per_s(_WATCHED_SLICE_S, system.pid, dashboard.pid)
            slices.append((is_watched, used))
        return _pairs_of(slices)


def _cpu_ms_per_s(seconds: float, *processes: int) -> float:
    """Return the CPU usage of processes during a slice."""
    before_s, began_s = sum(map(cpu_s, processes)), time.perf_counter()
    time.sleep(seconds)
    return 1000.0 * (sum(map(cpu_s, processes)) - before_s) / (time.perf_counter() - began_s)


def _stalled() -> tuple[float, float]:
    """Return the 99th percentiles of a callback with and without a client that reads nothing.

    In microseconds, of all slices of one run of the system.
    """
    with tempfile.TemporaryDirectory() as folder:
        slices = list(_stalled_slices(Path(folder)))
        calls = json.loads(Path(folder, "calls.json").read_text(encoding="utf-8"))
    found: dict[bool, list[float]] = {True: [], False: []}
    for is_requested, begin_ns, end_ns in slices:
        found[is_requested] += [took / 1000 for at, took in calls if begin_ns <= at < end_ns]
    return percentile(found[True], 0.99), percentile(found[False], 0.99)


def _stalled_slices(folder: Path) -> Iterator[tuple[bool, int, int]]:
    """Yield, for each slice, whether images are requested, and its begin and end in ns."""
    file = folder / "measured.yaml"
    file.write_text(_CAMERA, encoding="utf-8")
    (folder / "measured.py").write_text(_BEHAVIOR, encoding="utf-8")
    side = Side(("-m", "composer", "run", str(file)), "1 of 1 nodes active", re.compile(""))
    variables = environment()
    with ExitStack() as stack:
        system, _ = stack.enter_context(running(side, variables))
        _, address = stack.enter_context(running_dashboard(variables, str(file)))
        # Another browser, so that the dashboard stays in the ROS graph.
        other = stack.enter_context(_connected(address))
        threading.Thread(target=_read_all, args=(other,), daemon=True).start()
        time.sleep(_SETTLE_S)
        for is_requested in _alternating(_STALLED_PAIRS):
            with ExitStack() as client:
                if is_requested:
                    stalled = client.enter_context(_connected(address))
                    _subscribe(stalled, 0, "image", {"topic": "/image", "max_hz": 15})
                time.sleep(_STALLED_SETTLE_S)
                begin_ns = time.perf_counter_ns()
                time.sleep(_STALLED_SLICE_S)
                yield is_requested, begin_ns, time.perf_counter_ns()
        system.send_signal(signal.SIGINT)
        system.wait(_TIMEOUT_S)


@contextmanager
def running_dashboard(
    variables: Mapping[str, str], system: str
) -> Iterator[tuple[subprocess.Popen[bytes], re.Match[bytes]]]:
    """Context manager: run a dashboard, and yield it with its address."""
    command = [sys.executable, "-m", "composer", "dashboard", system, "--port", "0"]
    with subprocess.Popen(command, cwd=ROOT, env=variables, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            address = _URL.match(process.stdout.readline())
            if address is None:
                raise ProgramFailed("the dashboard has not started")
            yield process, address
        finally:
            process.terminate()  # killed, it would stay in the graph for 20 s
            process.send_signal(signal.SIGCONT)  # if it is stopped, it ends only then


def _connected(address: re.Match[bytes]) -> connect:
    """Return a connection with the token, for a ``with`` block."""
    host, token = (part.decode() for part in address.groups())
    # An extra, which the targets do without.
    from websockets.sync.client import connect  # noqa: PLC0415 - not everywhere

    return connect(
        f"ws://{host}/ws",
        origin=f"http://{host}",
        additional_headers={"Authorization": f"Bearer {token}"},
        compression=None,
        max_size=None,
        close_timeout=0.1,  # of a client that reads nothing
    )


def _subscribe(
    browser: ClientConnection, number: int, channel: str, parameters: dict[str, object]
) -> None:
    request = {"id": number, "op": "subscribe", "channel": channel, "params": parameters}
    browser.send(json.dumps(request))


def _read_all(browser: ClientConnection) -> None:
    for _ in browser:
        pass
