"""``compose diff``: a system as declared, held against what runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from composer.cli.commands.run import Autostart
from composer.cli.support.failure import FINDINGS, Failure
from composer.cli.support.files import system_file
from composer.cli.support.finite import finite
from composer.cli.support.help import examples
from composer.cli.support.listing import Json
from composer.cli.support.loaded import Namespace, SystemName, load_system
from composer.cli.support.ros import Timeout, ros_session
from composer.cli.support.terminal import say, write
from composer.cli.support.values import as_json

if TYPE_CHECKING:
    from composer.drift import Drift, Snapshot
    from composer.model import System
    from composer.remote.snapshot import Observer

EPILOG = examples(
    "compose diff pipeline                         exit code 1 when anything differs",
    "compose diff systems/pipeline.yaml --json     for programs",
    "compose diff pipeline --watch                 tell what changes, until Ctrl-C",
    "compose diff pipeline --ignore '/rviz*'       others that may be there, too",
    "compose diff pipeline --autostart inactive    as it was started",
)

_TIMEOUT_S = 10.0
_GRACE_S = 2.0
#: Between two looks of --watch; a look itself waits half a second for the graph to stand still.
_PAUSE_S = 0.5

Compare = Callable[["Snapshot"], tuple["Drift", ...]]


def diff(
    system: SystemName,
    *,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NODE.PARAMETER=VALUE",
            help="As it was given to compose run; repeatable.",
            show_default=False,
        ),
    ] = None,
    namespace: Namespace = None,
    autostart: Annotated[
        Autostart | None,
        typer.Option(help="How far the nodes were brought up.", show_default="as the file says"),
    ] = None,
    ignore: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATTERN",
            help="Full names of nodes that may be there undeclared (* for any text); repeatable.",
            show_default=False,
        ),
    ] = None,
    json: Json = False,
    watch: Annotated[
        bool, typer.Option("--watch", "-w", help="Keep looking, tell what appears and is resolved.")
    ] = False,
    watch_for: Annotated[
        float | None,
        typer.Option(
            "--for",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="End --watch after so long.",
            show_default="never",
        ),
    ] = None,
    grace: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="What lasts no longer than this is no difference.",
        ),
    ] = _GRACE_S,
    timeout: Timeout = _TIMEOUT_S,
) -> None:
    """Hold a system against the ROS graph: nodes, endpoints, types, QoS, parameters, states.

    Exit code 1 when anything differs. A system that is just starting gets time to: a difference
    counts once it has lasted for the grace time.
    """
    declared = _load(system, settings or [], namespace)
    compare = _comparison(declared, autostart, ignore or [])
    with ros_session("compose diff", timeout) as (session, deadline):
        from composer.remote.snapshot import Observer

        with Observer(session) as observer:
            if watch:
                left = _watched(observer, compare, (timeout, grace, watch_for), json=json)
            else:
                left = _settled(observer, compare, deadline.left_s, grace)
                _print(declared, left, json=json)
    if left:
        raise typer.Exit(FINDINGS)


def _load(text: str, settings: list[str], namespace: str | None) -> System:
    path = system_file(text)
    loading = load_system(path, shown=text, settings=settings, namespace=namespace)
    if loading.system is not None and loading.system.node_type:
        raise Failure(f"'{text}' is a node type, not a system")
    if loading.system is None or not loading.is_runnable:
        raise Failure(f"'{text}' has errors, so nothing can run as it says")
    return loading.system


def _comparison(system: System, autostart: Autostart | None, ignored: list[str]) -> Compare:
    from composer.drift import compare
    from composer.model import PrimaryState

    goal = PrimaryState(autostart.value) if autostart is not None else None
    return lambda snapshot: compare(system, snapshot, autostart=goal, ignored=ignored)


def _settled(
    observer: Observer, compare: Compare, timeout_s: float, grace_s: float
) -> tuple[Drift, ...]:
    """Return what differs: nothing as soon as nothing does, else what has lasted."""
    from composer.drift import Patience
    from composer.remote.session import Deadline

    deadline = Deadline(timeout_s)
    patience = Patience(grace_s)
    while True:
        drifts = compare(observer.look(deadline))
        patience.update(time.monotonic(), drifts)
        if patience.is_settled(drifts) or deadline.passed:
            return drifts


def _watched(
    observer: Observer,
    compare: Compare,
    seconds: tuple[float, float, float | None],
    *,
    json: bool,
) -> tuple[Drift, ...]:
    """Tell every change until Ctrl-C, or the end of the time; return what differs then."""
    from composer.drift import Patience
    from composer.remote.session import Deadline

    timeout_s, grace_s, watch_for_s = seconds
    end = Deadline(watch_for_s if watch_for_s is not None else float("inf"))
    patience = Patience(grace_s)
    try:
        while not end.passed:
            drifts = compare(observer.look(Deadline(min(timeout_s, end.left_s))))
            change = patience.update(time.monotonic(), drifts)
            for drift in change.resolved:
                write(_event("resolved", drift, json=json))
            for drift in change.appeared:
                write(_event("drift", drift, json=json))
            time.sleep(min(_PAUSE_S, end.left_s))
    except KeyboardInterrupt:
        pass  # that is how it ends
    return patience.told


def _print(system: System, drifts: tuple[Drift, ...], *, json: bool) -> None:
    if json:
        found = [_as_data(drift) for drift in drifts]
        data = {"system": system.name.value, "clean": not drifts, "drift": found}
        write(as_json(data, indent=2))
    elif drifts:
        write("\n".join(line for drift in drifts for line in _lines(drift)))
    count = len(drifts)
    differences = f"{count} difference{'s' if count != 1 else ''}"
    say(f"{system.name.value}: {differences if count else 'runs as declared'}")


def _event(what: str, drift: Drift, *, json: bool) -> str:
    if json:
        return as_json({"event": what, **_as_data(drift)})
    return "\n".join(
        f"{what}: {line}" if number == 0 else line for number, line in enumerate(_lines(drift))
    )


def _lines(drift: Drift) -> Iterator[str]:
    yield drift.message
    if drift.hint:
        yield f"  {drift.hint}"
    if drift.span is not None:
        yield f"  declared at {drift.span}"


def _as_data(drift: Drift) -> dict[str, Any]:
    return {
        "kind": drift.kind.value,
        "node": drift.node,
        "subject": drift.subject or None,
        "declared": drift.declared or None,
        "live": drift.live or None,
        "message": drift.message,
        "hint": drift.hint or None,
        "declared_at": None if drift.span is None else str(drift.span),
    }
