"""What a computer more costs the others, and what follows for many: docs/guides/sizing.md.

``python -m benchmarks.sizing``, as root: two computers are made of network namespaces. One only
observes, and the other runs a system. The costs of many computers are multiples of what the
observer needs for one.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import String

from benchmarks.processes import RESULT_MARK
from composer.runtime.protocol.codec import decode, encode
from composer.runtime.protocol.reports import (
    NodeReport,
    SystemReport,
    is_signed,
    signed,
    split_signature,
)
from tests.ros.network.namespaces import Computer, network

_SIZES = (10, 50)
_HOSTS = (10, 100, 1000)
#: Nothing announces the end of discovery; it goes on after the last node has appeared.
_SETTLE_S, _IDLE_S = 3.0, 15.0
_POLL_S = 0.2
_TIMEOUT_S = 120.0
_LEAN = dict.fromkeys(("parameters", "rosout", "type_description", "lifecycle_services"), False)
_REPORTS = 200
_KEY = "00" * 32
_PORT = 11811
_SERVER = {"ROS_DISCOVERY_SERVER": f"10.77.0.1:{_PORT}"}
_SERVER_COMMAND = (str(Path(sys.executable).with_name("fast-discovery-server")), "-i", "0")


@dataclass(frozen=True, slots=True)
class Cost:
    """What one participant costs another one: until it is discovered, and while both are idle."""

    memory_kb: float
    cpu_ms: float
    received_kb: float
    idle_bytes_s: float


def main() -> None:
    """Measure, and print the tables of the guide."""
    for discovery, variables in (("multicast", {}), ("server", _SERVER)):
        for name, introspection in (("all services", {}), ("no introspection", _LEAN)):
            print(f"{discovery}, {name}")
            for size in _SIZES:
                _print_costs(size, _discovery(size, introspection, variables))
    report_kb, report_ms = _reports()
    print(f"a report of {_SIZES[0]} nodes: {report_kb:.1f} KB, {report_ms:.2f} ms")
    for hosts in _HOSTS:
        share = report_ms * (hosts - 1) / 10.0
        print(f"| {hosts} | {report_kb * (hosts - 1):.0f} KB/s | {share:.1f} % |")


def _print_costs(size: int, cost: Cost) -> None:
    for hosts in _HOSTS:
        others = hosts - 1
        print(
            f"| {hosts} | {size} | {cost.memory_kb * others / 1000:.1f} MB "
            f"| {cost.cpu_ms * others / 1000:.2f} s | {cost.received_kb * others / 1000:.2f} MB "
            f"| {cost.idle_bytes_s * others / 1000:.1f} KB/s |"
        )


def _discovery(size: int, introspection: Mapping[str, bool], variables: Mapping[str, str]) -> Cost:
    """Measure what a computer with ``size`` nodes costs another one."""
    with ExitStack() as stack:
        here, other = stack.enter_context(network(("observer", "other")))
        if variables:
            stack.enter_context(_started(here, *_SERVER_COMMAND))
        ask = stack.enter_context(_observer(here, variables))
        before, received = ask(), _received(here)
        stack.enter_context(_system(other, size, introspection, variables))
        until_s = time.monotonic() + _TIMEOUT_S
        while ask()["nodes"] < size + 2:
            if time.monotonic() > until_s:
                sys.exit("the nodes were not discovered")
            time.sleep(_POLL_S)  # the observer answers questions only
        time.sleep(_SETTLE_S)
        after, found = ask(), _received(here)
        time.sleep(_IDLE_S)
        return Cost(
            1000.0 * (after["memory_mb"] - before["memory_mb"]),
            1000.0 * (after["cpu_s"] - before["cpu_s"]),
            (found - received) / 1000.0,
            (_received(here) - found) / _IDLE_S,
        )


@contextmanager
def _started(computer: Computer, *words: str, **options: Any) -> Iterator[subprocess.Popen[str]]:
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = computer.start(*words, **(quiet | options))
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def _observer(
    computer: Computer, variables: Mapping[str, str]
) -> Iterator[Callable[[], dict[str, Any]]]:
    words = (sys.executable, "-m", "benchmarks.programs.observer")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with _started(computer, *words, env=variables, **pipes) as process:
        stdin, stdout = process.stdin, process.stdout
        assert stdin is not None
        assert stdout is not None

        def ask() -> dict[str, Any]:
            stdin.write("\n")
            stdin.flush()
            line = next(line for line in stdout if line.startswith(RESULT_MARK))
            figures: dict[str, Any] = json.loads(line.removeprefix(RESULT_MARK))
            return figures

        yield ask


@contextmanager
def _system(
    computer: Computer, size: int, introspection: Mapping[str, bool], variables: Mapping[str, str]
) -> Iterator[None]:
    tree = {
        "system": "other",
        "introspection": dict(introspection),
        "nodes": {f"node_{number}": {} for number in range(size)},
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "other.yaml")
        path.write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")
        words = (sys.executable, "-m", "composer", "run", str(path))
        with _started(computer, *words, env=variables):
            yield


def _received(computer: Computer) -> int:
    (link,) = json.loads(computer.check("ip", "-s", "-j", "link", "show", "dev", "eth0"))
    return int(link["stats64"]["rx"]["bytes"])


def _reports() -> tuple[float, float]:
    """Return the size (KB) of a report of a process, and the CPU time (ms) to read it."""
    nodes = tuple(NodeReport(f"/lab/node_{number}", "active") for number in range(_SIZES[0]))
    text = signed(encode(SystemReport("lab/part", "running", nodes, "host", "1")), _KEY)
    data = serialize_message(String(data=text))
    began_s = time.process_time()
    for _ in range(_REPORTS):
        message = deserialize_message(data, String)
        assert is_signed(message.data, _KEY)
        decode(split_signature(message.data)[1], SystemReport)
    return len(data) / 1000.0, 1000.0 * (time.process_time() - began_s) / _REPORTS


if __name__ == "__main__":
    main()
