"""``compose ps``: the running systems and their nodes."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.support.errors import FAILED
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Json, Timeout, examples
from composer.cli.support.ros import require_ros, ros_session
from composer.cli.support.system_arguments import AnyRunningSystem, running_system_name
from composer.cli.support.terminal import as_json, columns, lines, write

if TYPE_CHECKING:
    from composer.client.systems.process_list import Processes, Reports
    from composer.runtime.protocol.codec import OtherVersionError
    from composer.runtime.protocol.reports import NodeReport, SystemReport

EPILOG = examples(
    "compose ps                     all running systems and other lifecycle nodes",
    "compose ps pipeline            a single system",
    "compose ps pipeline --ready    check that all of its nodes are up, as containers do",
    "compose ps --json              print JSON",
)

_HEAD = ("node", "state", "since", "restarts", "errors", "out Hz", "in Hz", "last error")
_PROCESS = "process"


def ps(
    system: AnyRunningSystem = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
    json: Json = False,
    ready: Annotated[
        bool,
        typer.Option(
            "--ready", help="Exit with 1 unless every node is in the state that it should have."
        ),
    ] = False,
) -> None:
    """List running systems and their nodes.

    For each node, the list has the state and its duration, the number of restarts and errors, the
    message rates of the last seconds (- if unknown), and the last error. A system is
    listed with the nodes of all its processes. Other lifecycle nodes are listed with their states,
    as are the nodes of a system that another version of ros2-composer runs. With --json, the output
    includes callback timings, which 'compose top' shows as a table.

    With --ready, the exit code is 1 if a system is being started or shut down, or is paused, if a
    node has failed, or if no system runs. A process of a system, such as robot/perception, is ready
    once the coordinating process has brought up its nodes.
    """
    name = None if system is None else running_system_name(system)
    listed = _ask(name, timeout, callbacks=json) or _discover(name, timeout, callbacks=json)
    write(_as_json(*listed) if json else _as_text(*listed))
    reports = listed[0].values()
    if ready and not (reports and all(getattr(item, "is_ready", False) for item in reports)):
        raise typer.Exit(FAILED)


def _ask(name: str | None, timeout: float, *, callbacks: bool) -> Processes | None:
    """Return what runs if the systems on this computer know that."""
    require_ros("compose ps")
    from composer.client.systems.local_queries import local_report, local_reports

    if name is None:
        reports = local_reports(timeout, callbacks=callbacks)
        return None if reports is None else (reports, {})
    report = local_report(name, timeout, callbacks=callbacks)
    return None if report is None else ({report.name: report}, {})


def _discover(name: str | None, timeout: float, *, callbacks: bool) -> Processes:
    with ros_session("compose ps", timeout) as (session, deadline):
        from composer.client.systems.process_list import list_one, list_processes

        if name is None:
            return list_processes(session, deadline, callbacks=callbacks)
        return list_one(session, deadline, name, callbacks=callbacks)


def _as_json(reports: Reports, others: Mapping[str, str | None]) -> str:
    content: dict[str, Any] = {
        "systems": [
            {"name": name} | ({"answered": False} if report is None else _report(report))
            for name, report in reports.items()
        ],
        "nodes": [{"node": node, "state": state} for node, state in others.items()],
    }
    return as_json(content, indent=2)


def _report(report: SystemReport | OtherVersionError) -> dict[str, Any]:
    """Return the report with the callbacks below their nodes."""
    if isinstance(report, Exception):
        return {"another_version": True, "message": str(report)}
    names = ("activity", "message", "host", "pid", "is_ready")
    content = {name: getattr(report, name) for name in names}
    content["nodes"] = nodes = [asdict(node) for node in report.nodes]
    content["chains"] = [asdict(chain) for chain in report.chains]
    for node in nodes:
        node["callbacks"] = [
            {key: value for key, value in asdict(item).items() if key not in ("node", "histogram")}
            for item in report.callbacks
            if item.node == node["node"]
        ]
    return content


def _as_text(reports: Reports, others: Mapping[str, str | None]) -> str:
    from composer.runtime.protocol.reports import SystemReport

    known = [report for report in reports.values() if isinstance(report, SystemReport)]
    processes = {name for report in known for name in report.processes.values()}
    parts = [
        system_text(name, report, is_listed=name in processes) for name, report in reports.items()
    ]
    if others:
        rows = [(node, state or "(no response)") for node, state in others.items()]
        title = "other lifecycle nodes" if parts else "lifecycle nodes"
        parts.append(f"{title}\n{columns(rows)}")
    return "\n\n".join(parts) or "no system is running"


def system_text(
    name: str, report: SystemReport | OtherVersionError | None, *, is_listed: bool = False
) -> str:
    """Return the part of a system; ``is_listed`` is whether another one has its nodes."""
    if report is None:
        return lines([f"{name}: no response, its process may be busy or gone"])
    if isinstance(report, Exception):
        return lines([f"{name}: {report}"])
    where = f"host {report.host}, process {report.pid}"
    title = lines([f"{name}: {report.activity}, {report.message} ({where})"])
    if is_listed:
        return title
    rows = [_HEAD, *(_row(node) for node in report.nodes)]
    if report.processes:
        names = (_PROCESS, *(node.process for node in report.nodes))
        rows = [(row[0], name, *row[1:]) for row, name in zip(rows, names, strict=True)]
    return f"{title}\n{columns(rows)}"


def _row(node: NodeReport) -> tuple[str, ...]:
    return (
        node.node,
        f"{node.state} ({node.condition})" if node.condition else node.state,
        _duration(time.time() - node.since_s),
        str(node.restarts),
        str(node.errors),
        "-" if node.sent_hz is None else f"{node.sent_hz:.1f}",
        "-" if node.received_hz is None else f"{node.received_hz:.1f}",
        node.last_error,
    )


def _duration(seconds: float) -> str:
    """Return a duration in its largest fitting unit: ``12 s``, ``3 min``, ``5 h``, ``2 d``."""
    for limit_s, unit_s, unit in ((120, 1, "s"), (7200, 60, "min"), (172_800, 3600, "h")):
        if seconds < limit_s:
            return f"{max(0, int(seconds / unit_s))} {unit}"
    return f"{int(seconds / 86_400)} d"
