"""``compose diff``: compare a system with the running ROS graph."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from composer.base.characters import counted
from composer.cli.support.errors import FAILED
from composer.cli.support.name_values import Arguments
from composer.cli.support.options import (
    Autostart,
    AutostartTo,
    Json,
    Namespace,
    Settings,
    Timeout,
    examples,
    quantity,
)
from composer.cli.support.ros import ros_session
from composer.cli.support.system_arguments import SystemName, runnable_system
from composer.cli.support.terminal import as_json, lines, say, write

if TYPE_CHECKING:
    from composer.client.snapshot import GraphObserver
    from composer.model import System
    from composer.plan.drift import Drift, Snapshot

EPILOG = examples(
    "compose diff pipeline                         exit with 1 if there are differences",
    "compose diff systems/pipeline.yaml --json     print JSON",
    "compose diff pipeline --watch                 print changes until Ctrl-C",
    "compose diff pipeline --ignore '/rviz*'       ignore undeclared nodes",
    "compose diff pipeline --autostart inactive    as given to compose run",
)

_TIMEOUT_S = 10.0
_GRACE_S = 2.0
#: The pause between two snapshots of --watch, each of which takes about half a second.
_PAUSE_S = 0.5

Compare = Callable[["Snapshot"], tuple["Drift", ...]]


def diff(
    system: SystemName,
    arguments: Arguments = None,
    *,
    settings: Settings = None,
    namespace: Namespace = None,
    autostart: AutostartTo = None,
    ignore: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATTERN",
            help="Ignore undeclared nodes whose full names match (* is any text). Repeatable.",
        ),
    ] = None,
    json: Json = False,
    watch: Annotated[
        bool,
        typer.Option(
            "--watch", "-w", help="Keep comparing; print differences as they appear and resolve."
        ),
    ] = False,
    grace: Annotated[
        float,
        quantity("SECONDS", "--grace", help="Ignore differences that last no longer than this."),
    ] = _GRACE_S,
    timeout: Timeout = _TIMEOUT_S,
) -> None:
    """Compare a system with the running ROS graph.

    The command compares nodes, endpoints, types, QoS policies, parameters and lifecycle states. A
    difference counts only after the grace time, so a system that is still starting is not reported.

    Exit code 1 if there are differences.
    """
    declared = runnable_system(system, arguments, settings=settings, namespace=namespace).system
    compare = _comparison(declared, autostart, ignore or [])
    with ros_session("compose diff", timeout) as (session, deadline):
        from composer.client.snapshot import GraphObserver

        with GraphObserver(session) as observer:
            if watch:
                remaining = _watched(observer, compare, timeout, grace, json=json)
            else:
                remaining = _settled(observer, compare, deadline.left_s, grace)
                _print(declared, remaining, json=json)
    if remaining:
        raise typer.Exit(FAILED)


def _comparison(system: System, autostart: Autostart | None, ignored: list[str]) -> Compare:
    from composer.model import PrimaryState
    from composer.plan.drift import compare

    goal = PrimaryState(autostart.value) if autostart is not None else None
    return lambda snapshot: compare(system, snapshot, autostart=goal, ignored=ignored)


def _settled(
    observer: GraphObserver, compare: Compare, timeout_s: float, grace_s: float
) -> tuple[Drift, ...]:
    """Return the differences: none as soon as there are none, else those that persist."""
    from composer.client.session import Deadline
    from composer.plan.drift import Debouncer

    deadline = Deadline(timeout_s)
    debouncer = Debouncer(grace_s)
    while True:
        drifts = compare(observer.snapshot(deadline))
        debouncer.update(time.monotonic(), drifts)
        if debouncer.is_settled(drifts) or deadline.passed:
            return drifts


def _watched(
    observer: GraphObserver, compare: Compare, timeout_s: float, grace_s: float, *, json: bool
) -> tuple[Drift, ...]:
    """Print changes until Ctrl-C; return the remaining differences."""
    from composer.client.session import Deadline
    from composer.plan.drift import Debouncer

    debouncer = Debouncer(grace_s)
    try:
        while True:
            drifts = compare(observer.snapshot(Deadline(timeout_s)))
            change = debouncer.update(time.monotonic(), drifts)
            for drift in change.resolved:
                write(event_text("resolved", drift, json=json))
            for drift in change.appeared:
                write(event_text("drift", drift, json=json))
            time.sleep(_PAUSE_S)
    except KeyboardInterrupt:
        pass  # the normal way to stop
    return debouncer.reported


def _print(system: System, drifts: tuple[Drift, ...], *, json: bool) -> None:
    if json:
        found = [drift.plain() for drift in drifts]
        data = {"system": system.name.value, "clean": not drifts, "drift": found}
        write(as_json(data, indent=2))
    elif drifts:
        write(lines(line for drift in drifts for line in _lines(drift)))
    differences = counted(len(drifts), "difference")
    say(f"{system.name.value}: {differences if drifts else 'runs as declared'}")


def event_text(what: str, drift: Drift, *, json: bool) -> str:
    """Return a difference that has come or gone, as text or as a line of JSON."""
    if json:
        return as_json({"event": what, **drift.plain()})
    return lines(
        f"{what}: {line}" if number == 0 else line for number, line in enumerate(_lines(drift))
    )


def _lines(drift: Drift) -> Iterator[str]:
    yield drift.message
    if drift.hint:
        yield f"  {drift.hint}"
    if drift.span is not None:
        yield f"  declared at {drift.span}"
