"""Synthetic systems of any size: areas with a chain of nodes each, and a topic for all nodes."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from composer.base.diagnostics import Diagnostic
from composer.graph.diagram import Graph
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load_bytes
from composer.model import System

_STAGES = ("camera", "detector", "tracker", "planner", "controller", "driver", "monitor")
_STRING = "type: std_msgs/msg/String"


def fleet_text(count: int, *, frames: bool = False) -> str:
    """Return the YAML of a system with ``count`` nodes.

    With ``frames`` it has transforms too, and needs tf2_msgs to run.
    """
    lines = [f"system: fleet_of_{count}", "nodes:"]
    for number in range(count):
        lines += _node(number // len(_STAGES) + 1, number % len(_STAGES), frames=frames)
    return "\n".join(lines) + "\n"


def _node(area: int, stage: int, *, frames: bool) -> list[str]:
    name = _STAGES[stage]
    half = "sense" if stage < 3 else "act"
    lines = [f"  {name}_{area}:", f"    namespace: area{area}/{half}", "    publishers:"]
    lines.append(f"      {name}_out: {{{_STRING}, topic: /area{area}/{name}, qos: sensor_data}}")
    if name == "monitor":
        lines.append(f"      health: {{{_STRING}, topic: /health, qos: state}}")
    if name == "camera" and area == 1:
        lines.append(f"      clock: {{{_STRING}, topic: /beat}}")
    lines.append("    subscriptions:")
    before = _STAGES[stage - 1]
    lines.append(f"      feed: {{{_STRING}, topic: /area{area}/{before}, qos: sensor_data}}")
    if name in ("tracker", "controller"):
        lines.append(f"      beat: {{{_STRING}, topic: /beat}}")
    trigger = f"plan: {{type: std_srvs/srv/Trigger, service: /area{area}/plan}}"
    if name == "planner":
        lines += ["    services:", f"      {trigger}"]
    if name == "controller":
        lines += ["    clients:", f"      {trigger}", "    lifecycle:"]
        lines.append(f"      depends_on: [planner_{area}]")
    parent = f"{before}_{area}" if stage else f"base_{area % 3}"
    frame = f"{name}_{area}: {{parent: {parent}, translation_m: {{x: 1}}}}"
    if frames:
        lines += ["    transforms:", f"      static: {{{frame}}}"]
    if name == "camera":
        lines += ["    timers:", "      tick: {rate_hz: 30, publish: {camera_out: {data: seen}}}"]
    return lines


@cache
def fleet(count: int) -> tuple[System, tuple[Diagnostic, ...]]:
    """Return a system with ``count`` nodes, and what the checks say about it."""
    text = fleet_text(count, frames=True).encode()
    loading = load_bytes(text, Path("/nowhere"), shown=f"fleet_of_{count}.yaml")
    assert loading.system is not None
    assert len(loading.system.nodes) == count
    return loading.system, tuple(loading.diagnostics)


def fleet_graph(count: int, view: View) -> Graph:
    """Return a diagram of such a system."""
    system, diagnostics = fleet(count)
    return build_graph(scene_of([system], diagnostics), view)
