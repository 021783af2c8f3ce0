"""What the commands for bags share: errors, options, the line of progress."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import CommandError
from composer.cli.support.options import quantity
from composer.cli.support.terminal import say

if TYPE_CHECKING:
    from composer.bags.bag import Bag
    from composer.bags.comparing import Tolerances
    from composer.bags.editing import Selection

BagPath = Annotated[
    Path, typer.Argument(metavar="BAG", help="The folder of a bag, or a .mcap or .db3 file.")
]
Topics = Annotated[
    list[str] | None,
    typer.Option(
        "--topics",
        metavar="PATTERN",
        help="Only topics with this full name; '*' stands for any text. Repeatable.",
        show_default="all",
    ),
]
Start = Annotated[float, quantity("SECONDS", "--start", help="Skip this much of the bag.")]
Duration = Annotated[
    float | None,
    quantity(
        "SECONDS", "--duration", help="Use only this much of the bag.", show_default="to its end"
    ),
]
Output = Annotated[
    Path, typer.Option("--output", "-o", metavar="FOLDER", help="The folder of the new bag.")
]
SplitMb = Annotated[
    float | None,
    quantity("MB", "--split-mb", help="Begin a new file before one is larger.", min=1.0),
]
SplitS = Annotated[
    float | None,
    quantity("SECONDS", "--split-s", help="Begin a new file before one is longer.", min=1.0),
]


Tolerance = Annotated[
    float, quantity("NUMBER", "--tolerance", help="Allowed difference of numbers.")
]
TimeTolerance = Annotated[
    float | None,
    quantity(
        "SECONDS",
        "--time-tolerance",
        help="Allowed difference of the times of messages.",
        show_default="only their order counts",
    ),
]
Ignore = Annotated[
    list[str] | None,
    typer.Option(
        "--ignore", metavar="FIELD", help="Fields to ignore, such as 'header.stamp.*'. Repeatable."
    ),
]


@contextmanager
def bag_errors() -> Iterator[None]:
    """Turn a BagError into a CommandError, also if a library of the extra is not installed.

    Signals that end a service or a terminal do the same as Ctrl-C: a bag is completed, and
    temporary files are deleted.
    """
    from composer.bags.bag import BagError, require
    from composer.runtime.process.watchdog import SAME_REQUEST_S, STOP_SIGNALS

    requested_s = -inf

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal requested_s
        if time.monotonic() - requested_s > SAME_REQUEST_S:
            requested_s = time.monotonic()
            signal.default_int_handler(number, frame)

    signals = [item for item in STOP_SIGNALS if signal.getsignal(item) is signal.SIG_DFL]
    for number in signals:
        signal.signal(number, interrupt)
    try:
        require("mcap")
        yield
    except BagError as error:
        raise CommandError(str(error), hint=error.hint) from error
    finally:
        for number in signals:
            signal.signal(number, signal.SIG_DFL)


def opened(path: Path) -> Bag:
    """Return a bag, and print what is missing in it. Raises BagError."""
    from composer.bags.reader import open_bag

    bag = open_bag(path)
    for warning in bag.warnings:
        say(f"warning: {warning}")
    return bag


def matches(topic: str, patterns: list[str] | None) -> bool:
    """Return whether ``--topics`` selects a topic."""
    from composer.model.names import matches_wildcard

    return not patterns or any(matches_wildcard(pattern, topic) for pattern in patterns)


def selection(topics: list[str] | None, start_s: float, duration_s: float | None) -> Selection:
    """Return the part of a bag that the options select."""
    from composer.bags.editing import Selection

    until_s = inf if duration_s is None else duration_s
    return Selection(lambda name: matches(name, topics), start_s, until_s)


def tolerances(value: float, time_s: float | None, ignored: list[str] | None) -> Tolerances:
    """Return what counts as equal."""
    from composer.bags.comparing import Tolerances

    return Tolerances(value, inf if time_s is None else time_s, tuple(ignored or ()))


def size_text(size_bytes: int) -> str:
    """Return a size in kB or MB."""
    return f"{size_bytes / 1e3:.1f} kB" if size_bytes < 1e6 else f"{size_bytes / 1e6:.1f} MB"


def show_progress(text: str) -> None:
    """Replace the last line of a terminal."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[K{text}")
        sys.stderr.flush()
