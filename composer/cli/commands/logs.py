"""``compose logs``: the log of a run."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.completion import complete_node
from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.options import Json, LogSeverity, examples
from composer.cli.support.system_arguments import running_system_name
from composer.cli.support.terminal import columns, say, use_color, write, write_raw

if TYPE_CHECKING:
    from composer.client.run_log import Run
    from composer.client.run_log.reading import Record, Selection, SystemLog

EPILOG = examples(
    "compose logs                                  the latest run in this domain",
    "compose logs planner motor_controller         two nodes",
    "compose logs -f --level warn                  follow warnings and errors",
    "compose logs --since 10m '/perception/*'      the last ten minutes",
    "compose logs --system pipeline --list         the runs of a system",
    "compose logs --json | jq -r .message          JSON, one object per line",
)

_COLORS = {"warn": "33", "error": "31", "fatal": "31"}


def logs(
    nodes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NODE]...",
            help="Nodes: full names, last parts of names, or patterns.",
            autocompletion=complete_node,
        ),
    ] = None,
    *,
    follow: Annotated[
        bool, typer.Option("--follow", "-f", help="Print new lines until the run ends.")
    ] = False,
    since: Annotated[
        str | None,
        typer.Option(
            "--since",
            metavar="TIME",
            help="Print lines since a time (2026-03-01T08:30), or within a duration (10m, 1h30m).",
        ),
    ] = None,
    level: Annotated[
        LogSeverity, typer.Option("--level", help="Minimum severity.")
    ] = LogSeverity.DEBUG,
    tail: Annotated[
        int | None,
        typer.Option("--tail", "-n", metavar="LINES", min=0, help="Begin with the last lines."),
    ] = None,
    system: Annotated[
        str | None,
        typer.Option(
            "--system",
            "-s",
            metavar="SYSTEM",
            help="Name or file of the system.",
            show_default="the system that was started last in this ROS domain",
        ),
    ] = None,
    run: Annotated[
        str | None,
        typer.Option(
            "--run", metavar="RUN", help="A run as --list prints it.", show_default="the last one"
        ),
    ] = None,
    list_runs: Annotated[bool, typer.Option("--list", help="List the runs instead.")] = False,
    json: Json = False,
) -> None:
    """Print the log of a running or finished system.

    By default, the command prints the last run in the current ROS domain (ROS_DOMAIN_ID); if there
    is none, the last run in any domain. A heading on stderr names the run.

    The log includes all processes of the system on this computer, and the processes on other
    computers that 'compose hosts run' started from here.

    'compose run' writes what it prints, with the date and time, to the folder 'compose' of the ROS
    log folder (ROS_LOG_DIR, by default ~/.ros/log). It keeps up to 50 MB of each run, and the last
    20 runs of each system.
    """
    selection = _selection(nodes or [], since, level)
    runs = _runs(system)
    if list_runs:
        write(_listed(runs, json=json))
        return
    chosen = _chosen(runs, run)
    from composer.client.run_log.reading import SystemLog

    folder = _folder()
    if not json:
        say(_heading(chosen))
    printed = 0
    try:
        with SystemLog(folder, chosen) as log:
            for record in _records(log, selection, follow=follow, tail=tail):
                _print(record, json=json)
                printed += 1
        if not printed and selection.nodes:
            with SystemLog(folder, chosen) as log:
                _explain_nothing(log, chosen, selection)
    except KeyboardInterrupt:
        raise typer.Exit(0) from None
    except OSError as error:
        raise CommandError(f"cannot read the log: {error}") from error


def _selection(nodes: list[str], since: str | None, level: LogSeverity) -> Selection:
    from composer.client.run_log.reading import Selection, parse_since

    since_ns = 0 if since is None else parse_since(since, datetime.now().astimezone())
    if since_ns is None:
        raise UsageError(
            f"'{since}' is neither a time nor a duration",
            hint="for example: 2026-03-01T08:30, 90s, 10m, 1h30m, 2d",
        )
    return Selection(tuple(nodes), since_ns, level.value)


def _runs(system: str | None) -> list[Run]:
    """Return the runs of a system, or all. Raises CommandError if there are none."""
    from composer.client.run_log import find_runs

    folder = _folder()
    name = None if system is None else running_system_name(system)
    found = find_runs(folder, name)
    if found:
        return found
    known = sorted({run.system for run in find_runs(folder)})
    if name is None or not known:
        where = f"looked in '{folder}'; 'compose run' writes logs"
        raise CommandError("no system has been run yet", hint=where)
    raise CommandError(
        f"there is no log of a system '{name}'", hint=f"systems with logs: {', '.join(known)}"
    )


def _folder() -> Path:
    """Return the ROS log folder. Raises CommandError if there is none."""
    from composer.runtime.middleware.environment import log_folder

    folder = log_folder(os.environ)
    if folder is None:
        raise CommandError(
            "no system has been run yet",
            hint="neither ROS_LOG_DIR nor HOME is set; 'compose run' writes logs",
        )
    return folder


def _chosen(runs: list[Run], name: str | None) -> Run:
    if name is None:
        from composer.client.run_log import current_domain

        domain = current_domain()
        return next((run for run in reversed(runs) if run.domain == domain), runs[-1])
    for run in runs:
        if run.name == name:
            return run
    from composer.base.diagnostics import suggestion

    hint = suggestion(name, (run.name for run in runs), limit=0)
    raise CommandError(
        f"there is no run '{name}'", hint=hint or "'compose logs --list' lists the runs"
    )


def _heading(run: Run) -> str:
    domain = f", domain {run.domain}" if run.domain else ""
    state = "running" if run.is_running() else "ended"
    return f"==> {run.system}{domain}, started {_local(run)}, {state} (run {run.name})"


def _local(run: Run) -> str:
    return run.started.strftime("%Y-%m-%d %H:%M:%S")


def _listed(runs: list[Run], *, json: bool) -> str:
    if json:
        from composer.cli.support.terminal import as_json

        content = [
            {
                "run": run.name,
                "system": run.system,
                "domain": run.domain or None,
                "started": run.started.isoformat(timespec="milliseconds"),
                "running": run.is_running(),
                "folder": str(run.folder),
            }
            for run in runs
        ]
        return as_json(content, indent=2)
    rows = [("run", "system", "domain", "started", "process", "folder")]
    for run in runs:
        process = f"{run.pid} (running)" if run.is_running() else run.pid
        domain = run.domain or "-"
        rows.append((run.name, run.system, domain, _local(run), process, _short(run.folder)))
    return columns(rows)


def _short(folder: Path) -> str:
    try:
        return f"~/{folder.relative_to(Path.home())}"
    except (ValueError, RuntimeError):
        return str(folder)


def _records(
    log: SystemLog, selection: Selection, *, follow: bool, tail: int | None
) -> Iterator[Record]:
    written = (record for record in log.new() if record in selection)
    yield from written if tail is None else deque(written, maxlen=tail)
    if follow:
        yield from (record for record in log.follow() if record in selection)


def _print(record: Record, *, json: bool) -> None:
    if json:
        from composer.cli.support.terminal import as_json

        write(as_json(record.content()))
        return
    from composer.cli.support.line_format import LineFormat, file_format

    text = LineFormat(file_format()).render(record)
    color = _COLORS.get(record.level)
    if color and use_color(sys.stdout):
        write_raw(f"\x1b[{color}m{text}\x1b[0m\n")
    else:
        write(text)


def _explain_nothing(log: SystemLog, run: Run, selection: Selection) -> None:
    known = sorted({record.node for record in log.new() if record.node})
    names = ", ".join(selection.nodes)
    say(
        f"no line of {names} in this log of {run.system}; nodes in it: {', '.join(known) or 'none'}"
    )
