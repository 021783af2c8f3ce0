"""``compose top``: what the callbacks of a running system take, live."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.failure import Failure, UsageFailure
from composer.cli.support.finite import finite
from composer.cli.support.help import examples
from composer.cli.support.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.support.screen import Screen
from composer.cli.support.system_name import AnyRunningSystem, name_of_system
from composer.cli.support.terminal import write

if TYPE_CHECKING:
    from composer.cli.support.top_table import Sorting
    from composer.remote.session import Session
    from composer.remote.systems import SystemReport, Systems

EPILOG = examples(
    "compose top                   the running system, until q or Ctrl-C",
    "compose top pipeline          one of several",
    "compose top --sort late       timers that come late first",
    "compose top --once            one table, for a log",
    "compose top --json            a line of JSON each second, for programs",
)
_SORTINGS = "busy, calls, mean, p99, max, late, dropped or node"
#: A manager tells each second, more or less.
_EARLY_S = 0.5
_SILENT_S = 5.0


def top(
    system: AnyRunningSystem = None,
    *,
    sort: Annotated[
        str, typer.Option("--sort", metavar="WHAT", help=f"What comes first: {_SORTINGS}.")
    ] = "busy",
    once: Annotated[bool, typer.Option("--once", help="Show one table and end.")] = False,
    interval: Annotated[
        float,
        typer.Option(
            "--interval",
            metavar="SECONDS",
            min=1.0,
            callback=finite,
            help="How often to show it anew.",
        ),
    ] = 1.0,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print lines of JSON, for programs.")
    ] = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Show what the callbacks of a running system take: the busiest first.

    Calls a second and the share of a thread are those of the last interval; mean, p99 and max are
    since the start. 'late' is how long after its time a timer is called (p99), 'over' counts calls
    over their budget_ms, 'dropped' what a full queue pushed out.
    """
    name = None if system is None else name_of_system(system)
    with ros_session("compose top", timeout) as (session, deadline):
        from composer.cli.support.top_table import Sorting
        from composer.remote.systems import Systems

        if sort not in list(Sorting):
            raise UsageFailure(f"cannot sort by '{sort}'", hint=f"what there is: {_SORTINGS}")
        systems = Systems(session, deadline, callbacks=True)
        found = systems.only() if name is None else systems.find(name)
        follower = _Follower(session, systems, systems.report(found))
        sorting = Sorting(sort)
        with Screen(wanted=not (once or as_json)) as screen:
            while follower.wait(interval, screen.is_left):
                text = follower.text(sorting, screen.lines, as_json=as_json)
                if once:
                    write(text)
                    return
                screen.draw(text)


class _Follower:
    """Looks at a system again and again."""

    def __init__(self, session: Session, systems: Systems, report: SystemReport) -> None:
        self._session = session
        self._systems = systems
        self._before = self._now = report

    def wait(self, interval_s: float, is_left: Callable[[], bool]) -> bool:
        """Wait for the system as it is an interval from now; false when ``is_left`` says so.

        Raises Failure when the system tells no more.
        """
        from composer.remote.session import Deadline

        wanted_s = self._now.callbacks_at_s + interval_s - _EARLY_S
        patience = Deadline(interval_s + _SILENT_S)
        while not is_left():
            report = self._systems.newer(self._now.name, wanted_s)
            if report is not None:
                self._before, self._now = self._now, report
                return True
            if patience.passed:
                raise Failure(f"{self._now.name} does not tell any more, it may have ended")
            self._session.spin_once(patience)
        return False

    def text(self, sorting: Sorting, lines: int | None, *, as_json: bool) -> str:
        """Return the table, of at most so many lines, or the JSON."""
        from composer.cli.support import top_table

        callbacks = top_table.sorted_rates(self._before, self._now, sorting)
        if as_json:
            return json.dumps(top_table.as_json(self._now, callbacks))
        return top_table.table(self._now, callbacks, lines)
