"""``compose ps``: the running systems and their nodes at a glance."""

from __future__ import annotations

import json
import time
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.help import examples
from composer.cli.support.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.support.system_name import AnyRunningSystem, name_of_system
from composer.cli.support.terminal import columns, write

if TYPE_CHECKING:
    from composer.remote.process_list import ProcessList
    from composer.remote.systems import NodeReport, SystemReport

EPILOG = examples(
    "compose ps                 every running system, and lifecycle nodes of others",
    "compose ps pipeline        one system",
    "compose ps --json          for programs",
)

_HEAD = ("node", "state", "since", "restarts", "errors", "out Hz", "in Hz", "last error")


def ps(
    system: AnyRunningSystem = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
) -> None:
    """List running systems: the state of each node, since when, its rates, what went wrong last.

    Rates are of topic messages over the last second. With --json what callbacks take is told, too;
    'compose top' shows it. Lifecycle nodes that no composer runs are listed with their states. Who
    does not answer is said to be so.
    """
    name = None if system is None else name_of_system(system)
    with ros_session("compose ps", timeout) as (session, deadline):
        from composer.remote.process_list import list_one, list_processes

        if name is None:
            listed = list_processes(session, deadline, callbacks=as_json)
        else:
            listed = list_one(session, deadline, name, callbacks=as_json)
    write(_json(listed) if as_json else _text(listed))


def _json(listed: ProcessList) -> str:
    content: dict[str, Any] = {
        "systems": [
            {"name": name} | ({"answered": False} if report is None else _report(report))
            for name, report in listed.systems.items()
        ],
        "nodes": [{"node": node, "state": state} for node, state in listed.others.items()],
    }
    return json.dumps(content, indent=2)


def _report(report: SystemReport) -> dict[str, Any]:
    """Return the report with the callbacks of each node where the node is."""
    content = asdict(report)
    content.pop("callbacks_at_s")
    callbacks = content.pop("callbacks")
    for node in content["nodes"]:
        node["callbacks"] = [
            {key: value for key, value in callback.items() if key != "node"}
            for callback in callbacks
            if callback["node"] == node["node"]
        ]
    return content


def _text(listed: ProcessList) -> str:
    parts = [_system(name, report) for name, report in listed.systems.items()]
    if listed.others:
        rows = [(node, state or "(no answer)") for node, state in listed.others.items()]
        title = "other lifecycle nodes" if parts else "lifecycle nodes"
        parts.append(f"{title}\n{columns(rows)}")
    return "\n\n".join(parts) or "nothing is running"


def _system(name: str, report: SystemReport | None) -> str:
    if report is None:
        return f"{name}: no answer, its process may be busy or gone"
    where = f"host {report.host}, process {report.pid}"
    rows = [_HEAD, *(_row(node) for node in report.nodes)]
    return f"{name}: {report.activity}, {report.message} ({where})\n{columns(rows)}"


def _row(node: NodeReport) -> tuple[str, ...]:
    return (
        node.node,
        f"{node.state} (failed)" if node.held_down else node.state,
        duration(time.time() - node.since_s),
        str(node.restarts),
        str(node.errors),
        f"{node.sent_hz:.1f}",
        f"{node.received_hz:.1f}",
        node.last_error,
    )


def duration(seconds: float) -> str:
    """Return a time as people say it: ``12 s``, ``3 min``, ``5 h``, ``2 d``."""
    for limit_s, unit_s, unit in ((120, 1, "s"), (7200, 60, "min"), (172_800, 3600, "h")):
        if seconds < limit_s:
            return f"{max(0, int(seconds / unit_s))} {unit}"
    return f"{int(seconds / 86_400)} d"
