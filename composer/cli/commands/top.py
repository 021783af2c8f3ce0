"""``compose top``: the callbacks of a running system, live."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Self

import typer

from composer.base.characters import escape_lines
from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Timeout, examples
from composer.cli.support.ros import ros_session
from composer.cli.support.system_arguments import AnyRunningSystem, running_system_name
from composer.cli.support.terminal import Keys, as_json, write, write_raw

if TYPE_CHECKING:
    from composer.cli.support.callback_tables import SortKey
    from composer.client.session import Session
    from composer.client.systems.managers import Systems
    from composer.runtime.protocol.reports import SystemReport

EPILOG = examples(
    "compose top                   show the running system; press q to quit",
    "compose top pipeline          show one of several systems",
    "compose top --sort late       show the most delayed timers first",
    "compose top --once            print one table and exit",
    "compose top --json            print a line of JSON every second",
)
_SORT_KEYS = "busy, calls, mean, p99, max, late, dropped or node"
#: A system without a report for this long may have ended.
_NO_REPORT_S = 6.0
#: The other processes of a system also report every second, at times of their own.
_OTHERS_WITHIN_S = 2.5

_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"
_HOME, _CLEAR_LINE, _CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"
_QUIT_KEYS = "qQ\x03\x04\x1b"


def top(
    system: AnyRunningSystem = None,
    *,
    sort: Annotated[
        str, typer.Option("--sort", metavar="KEY", help=f"Sort by {_SORT_KEYS}.")
    ] = "busy",
    once: Annotated[bool, typer.Option("--once", help="Print one table and exit.")] = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print one line of JSON per update.")
    ] = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Show the timings of callbacks in a running system.

    'calls/s' is the rate of the last seconds, 'busy' the share of a thread in the last second.
    All other values are since the start: 'late' is how late a timer is called (99th percentile),
    'over' counts calls that took longer than their budget_ms, and 'dropped' counts messages dropped
    from full queues.
    """
    from composer.cli.support.callback_tables import SortKey

    if sort not in list(SortKey):
        raise UsageError(f"cannot sort by '{sort}'", hint=f"expected {_SORT_KEYS}")
    name = None if system is None else running_system_name(system)
    with ros_session("compose top", timeout) as (session, deadline):
        from composer.client.systems.managers import Systems

        systems = Systems(session, deadline, callbacks=True)
        found = systems.only() if name is None else systems.find(name)
        others_within_s = _NO_REPORT_S if once else _OTHERS_WITHIN_S
        follower = _Follower(session, systems, systems.report(found), others_within_s)
        key = SortKey(sort)
        with _Screen(full=not (once or json)) as screen:
            while follower.wait(screen.quit_requested):
                text = follower.json(key) if json else follower.table(key, screen.lines)
                if once:
                    write(text)
                    return
                screen.draw(text)


class _Follower:
    """Follows the reports of a system."""

    def __init__(
        self, session: Session, systems: Systems, report: SystemReport, others_within_s: float
    ) -> None:
        self._session = session
        self._systems = systems
        from composer.cli.support.callback_tables import SystemMeter

        self._others_within_s = others_within_s
        self._now = systems.whole(report)
        self._meter = SystemMeter()
        self._rates = self._meter.read(self._now)
        self._silent: set[str] = set()  # processes without new rates after the last wait

    def wait(self, quit_requested: Callable[[], bool]) -> bool:
        """Wait for new rates; return False if ``quit_requested`` is true first.

        Raises CommandError if the system stops reporting.
        """
        from composer.client.session import Deadline

        before_s = self._meter.rated_s(self._now)
        deadline, others = Deadline(_NO_REPORT_S), Deadline(self._others_within_s)
        while not quit_requested():
            report = self._systems.current()[self._now.name]
            if report is not None:
                self._now = self._systems.whole(report)
                self._rates = self._meter.read(self._now)
            rated_s = self._meter.rated_s(self._now)
            silent = {name for name, at_s in rated_s.items() if at_s in (None, before_s.get(name))}
            if "" not in silent and (silent <= self._silent or others.passed):
                self._silent = silent
                return True
            if "" in silent and deadline.passed:
                raise CommandError(
                    f"{self._now.name} stopped publishing its status, it may have ended"
                )
            self._session.spin_once(deadline if "" in silent else others)
        return False

    def table(self, key: SortKey, max_lines: int | None) -> str:
        """Return a table of at most ``max_lines`` lines."""
        from composer.cli.support.callback_tables import in_order, top_table

        return top_table(self._now, in_order(self._rates, key), max_lines)

    def json(self, key: SortKey) -> str:
        """Return the same as one line of JSON."""
        from composer.cli.support.callback_tables import in_order, top_data

        return as_json(top_data(self._now, in_order(self._rates, key)))


class _Screen:
    """A full-screen display that is redrawn, for a ``with`` block.

    Frames are printed one below the other if stdout is not a terminal or ``full`` is false.
    """

    def __init__(self, *, full: bool = True) -> None:
        self._is_full = full and sys.stdout.isatty() and sys.stdin.isatty()
        self._keys = Keys(enabled=self._is_full)

    def __enter__(self) -> Self:
        self._keys.__enter__()
        if self._is_full:
            write_raw(_ENTER)
        return self

    def __exit__(self, *_: object) -> None:
        self._keys.__exit__()
        if self._is_full:
            write_raw(_LEAVE)

    @property
    def lines(self) -> int | None:
        """The height of the screen; None without a limit."""
        return shutil.get_terminal_size().lines if self._is_full else None

    def draw(self, text: str) -> None:
        """Show ``text`` in place of the last frame."""
        if not self._is_full:
            write(f"{text}\n" if "\n" in text else text)  # a blank line between tables
            return
        width = shutil.get_terminal_size().columns
        shown = "\n".join(f"{line[:width]}{_CLEAR_LINE}" for line in escape_lines(text).split("\n"))
        write_raw(f"{_HOME}{shown}{_CLEAR_BELOW}")

    def quit_requested(self) -> bool:
        """Say whether the user has pressed q, Escape or Ctrl-C."""
        key = self._keys.pressed()
        return key is not None and key in _QUIT_KEYS
