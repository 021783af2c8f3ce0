"""The CPU time and memory of processes, and of which systems they are."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from composer.client.systems.local_queries import of_system, of_whole_systems
from composer.dashboard.channels.nodes import ProcessMonitor, total
from composer.dashboard.protocol.messages import to_json
from composer.runtime.protocol.reports import NodeReport, SystemReport

BUSY = "print(flush=True)\nwhile True: pass"


def usage(cpu_percent: float | None, memory_mb: float = 10.0) -> dict[str, float | None]:
    return {"cpu_percent": cpu_percent, "memory_mb": memory_mb, "threads": 2, "up_s": memory_mb}


def test_the_usage_is_that_of_each_process() -> None:
    monitor = ProcessMonitor()
    with subprocess.Popen([sys.executable, "-c", BUSY], stdout=subprocess.PIPE) as busy:
        try:
            assert busy.stdout is not None
            busy.stdout.readline()
            pid = str(busy.pid)
            first = monitor.usage(pid)
            assert first is not None
            assert first["cpu_percent"] is None
            assert first["memory_mb"] > 1
            assert first["threads"] == 1
            while not (monitor.usage(pid) or {})["cpu_percent"]:
                pass
        finally:
            busy.kill()
    assert monitor.usage(pid) is None
    own = monitor.usage(str(os.getpid()))
    assert own is not None
    assert own["cpu_percent"] is None
    for text in ("", "unknown", "-1", "1/../2", "²"):  # only ids of processes are read
        assert monitor.usage(text) is None


def test_the_usage_of_a_system_is_that_of_its_processes() -> None:
    assert total([usage(1.5), None, usage(2.0, 20.0)]) == {
        "cpu_percent": 3.5,
        "memory_mb": 30.0,
        "threads": 4,
        "up_s": 20.0,
        "processes": 2,
    }
    assert (total([usage(1.5), usage(None)]) or {})["cpu_percent"] is None
    assert total([None]) is None
    assert json.loads(to_json(total([usage(0.1), usage(0.2)])))["cpu_percent"] == 0.3


def report(name: str, **nodes: dict[str, str]) -> SystemReport:
    reported = tuple(NodeReport(f"/{node}", "active", **nodes[node]) for node in nodes)  # type: ignore[arg-type]
    return of_system(name, SystemReport(name, "running", reported, "robot", "1"))


def test_nodes_have_their_process_and_a_system_is_listed_once() -> None:
    found = report(
        "/robot",
        own={"pid": "1", "host": ""},
        other={"pid": "2", "host": "arm", "process": "acting"},
        ended={"pid": "", "host": ""},
    )
    places = [(node.host, node.pid) for node in found.nodes]
    assert places == [("robot", "1"), ("arm", "2"), ("robot", "")]
    whole = report("/robot", other={"process": "acting"})
    acting, alone = report("/robot/acting", other={}), report("/robot/lab", node={})
    reports = {"/robot": whole, "/robot/acting": acting, "/robot/lab": alone, "/silent": None}
    assert of_whole_systems(reports).keys() == {"/robot", "/robot/lab", "/silent"}
    # Without the report of the system, only they have their nodes.
    assert "/robot/acting" in of_whole_systems({**reports, "/robot": None})
