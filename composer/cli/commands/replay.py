"""``compose replay``: publish the messages of a bag, or run a system on them in virtual time."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.bags import (
    BagPath,
    Duration,
    Ignore,
    Start,
    TimeTolerance,
    Tolerance,
    Topics,
    bag_errors,
    opened,
    selection,
    show_progress,
    tolerances,
)
from composer.cli.support.errors import FAILED, CommandError, UsageError
from composer.cli.support.name_values import Arguments
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Settings, Timeout, examples, quantity
from composer.cli.support.ros import require_interfaces, require_modules, require_ros, ros_session
from composer.cli.support.system_arguments import complete_system, runnable_system
from composer.cli.support.terminal import Keys, lines, say, write

if TYPE_CHECKING:
    from composer.bags.bag import Bag
    from composer.bags.comparing import Tolerances
    from composer.bags.editing import Selection
    from composer.bags.ros_graph import ReplayOptions
    from composer.testing.bag_replay import Replay

EPILOG = examples(
    "compose replay run1                                  publish all topics at their times",
    "compose replay run1 --rate 4 --loop --clock          four times as fast, again and again",
    "compose replay run1 pipeline --replace sensor_simulator --compare run1",
)
_PROGRESS_NS = 1_000_000_000


def replay(
    bag: BagPath,
    system: Annotated[
        str | None,
        typer.Argument(
            metavar="[SYSTEM]",
            help="A system to run on the bag in virtual time, by its file or name.",
            autocompletion=complete_system,
        ),
    ] = None,
    arguments: Arguments = None,
    *,
    topics: Topics = None,
    start: Start = 0.0,
    duration: Duration = None,
    rate: Annotated[
        float, quantity("FACTOR", "--rate", "-r", help="Speed of the replay.", min=0.001)
    ] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", "-l", help="Start again at the end.")] = False,
    clock: Annotated[
        bool, typer.Option("--clock", help="Publish the time of the bag on /clock.")
    ] = False,
    remap: Annotated[
        list[str] | None,
        typer.Option(
            "--remap", "-m", metavar="OLD:=NEW", help="Publish a topic by another name. Repeatable."
        ),
    ] = None,
    replace: Annotated[
        list[str] | None,
        typer.Option(
            "--replace",
            metavar="NODE",
            help="Leave out this node of SYSTEM; the bag stands in for it. Repeatable.",
        ),
    ] = None,
    settings: Settings = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Record what SYSTEM publishes in a new bag."
        ),
    ] = None,
    compare: Annotated[
        Path | None,
        typer.Option(
            "--compare", metavar="GOLDEN", help="Compare what SYSTEM publishes with this bag."
        ),
    ] = None,
    tolerance: Tolerance = 0.0,
    time_tolerance: TimeTolerance = None,
    ignore: Ignore = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Replay a bag.

    Without SYSTEM, the messages are published with the QoS profiles of the bag, once discovery is
    complete. In a terminal, the space key pauses the replay and resumes it.

    With SYSTEM, the system runs in virtual time, isolated from the ROS graph. The topics that it
    receives and does not publish come from the bag. Its clock shows the time of the bag. With
    --compare, the first difference of each topic is printed, up to the last message of the bag that
    was played.

    Exit code 1 if there are differences.
    """
    of_graph = {"--loop": loop, "--clock": clock, "--remap": remap, "--rate": rate != 1.0}
    of_system = {
        "--replace": replace,
        "--set": settings,
        "--output": output,
        "--compare": compare,
    }
    for name, value in (of_graph if system is not None else of_system).items():
        if value:
            with_or_without = "without" if system is not None else "with"
            raise UsageError(f"{name} can only be used {with_or_without} SYSTEM")
    with bag_errors():
        chosen = selection(topics, start, duration)
        found = opened(bag)
        if system is None:
            _publish(found, chosen, _options(rate, remap, clock=clock), timeout, loop=loop)
            return
        golden = None if compare is None else opened(compare)
        done = _run(found, chosen, (system, arguments, settings), replace or [])
        if output is not None:
            _write(done, output)
        _report(done, golden, tolerances(tolerance, time_tolerance, ignore))


def _options(rate: float, remap: list[str] | None, *, clock: bool) -> ReplayOptions:
    """Return the options. Raises UsageError."""
    from composer.bags.ros_graph import ReplayOptions

    names: dict[str, str] = {}
    for text in remap or ():
        old, separator, new = text.partition(":=")
        if not separator or not old.startswith("/") or not new.startswith("/"):
            raise UsageError(f"--remap takes /OLD:=/NEW, not '{text}'")
        names[old] = new
    return ReplayOptions(rate, names, clock)


class _Progress:
    """The line of progress, and the key that pauses."""

    def __init__(self, bag: Bag, keys: Keys) -> None:
        self.next_ns = 0
        self._summary = bag.summary
        self._keys = keys
        self._at_ns = bag.summary.start_ns
        self._is_paused = False

    def is_paused(self) -> bool:
        """Read a key; return whether the replay is paused."""
        if self._keys.pressed() == " ":
            self._is_paused = not self._is_paused
            self._show()
        return self._is_paused

    def show(self, recorded_ns: int) -> None:
        """Show the time of a message, once per second of the bag."""
        self._at_ns = recorded_ns
        if recorded_ns >= self.next_ns:
            self.next_ns = recorded_ns + _PROGRESS_NS
            self._show()

    def _show(self) -> None:
        at_s = (self._at_ns - self._summary.start_ns) / 1e9
        text = f"{at_s:.0f} of {self._summary.duration_s:.0f} s"
        if self._keys.enabled:
            text += ", paused (space resumes)" if self._is_paused else " (space pauses)"
        show_progress(text)


def _publish(
    bag: Bag, chosen: Selection, options: ReplayOptions, timeout_s: float, *, loop: bool
) -> None:
    topics = [bag.summary.topics[name] for name in sorted(chosen.topics(bag))]
    start_ns = bag.summary.start_ns + round(chosen.start_s * 1e9)
    with (
        ros_session("compose replay", timeout_s, carries_messages=True) as (session, _),
        Keys() as keys,
    ):
        from composer.bags.ros_graph import GraphReplay

        progress = _Progress(bag, keys)
        options = replace(options, is_paused=progress.is_paused)
        replayed = GraphReplay(session, topics, options, lambda text: say(f"warning: {text}"))
        replayed.wait_for_subscriptions(timeout_s)
        try:
            for _ in count() if loop else range(1):
                progress.next_ns = start_ns
                replayed.play(chosen.messages(bag), start_ns, progress.show)
        except KeyboardInterrupt:
            pass
        show_progress("")
        if not replayed.finish():
            say("warning: not every reliable subscription has acknowledged all messages")
        write(f"{replayed.count} messages")


def _run(
    bag: Bag,
    chosen: Selection,
    system: tuple[str, list[str] | None, list[str] | None],
    replaced: list[str],
) -> Replay:
    """Run the system on the bag. Raises BagError, CommandError."""
    name, arguments, settings = system
    declared = runnable_system(name, arguments, settings=settings).system
    require_ros("compose replay", declared)
    require_interfaces(declared)
    require_modules(declared)
    from composer.runtime.process import StartRefused
    from composer.testing.bag_replay import replay as replay_into
    from composer.testing.bag_replay import without_nodes
    from composer.testing.failures import TestFailure

    try:
        return replay_into(without_nodes(declared, replaced), bag, chosen)
    except StartRefused as refusal:
        raise CommandError(str(refusal), hint=refusal.hint) from refusal
    except TestFailure as failure:
        raise CommandError(str(failure)) from failure


def _write(done: Replay, folder: Path) -> None:
    from composer.bags.system_recording import attachments
    from composer.bags.writer import BagWriter

    writer = BagWriter(folder, attachments=attachments(None))
    for topic in done.topics:
        writer.add_topic(topic)
    for message in done.messages:
        writer.write(message)
    writer.close()
    say(f"recorded {writer.count} messages: {folder}")


def _report(done: Replay, golden: Bag | None, limits: Tolerances) -> None:
    counts = f"played {len(done.played)} messages; the system published {len(done.messages)}"
    if golden is None:
        write(counts)
        return
    found = done.differences(golden, limits)
    if not found:
        write(f"{counts}, equal to the messages of the bag")
        return
    write(lines(map(str, found)))
    raise typer.Exit(FAILED)
