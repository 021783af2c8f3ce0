"""``compose bag``: what is in a bag, parts of bags, and differences between two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.bags import (
    BagPath,
    Duration,
    Ignore,
    Output,
    SplitMb,
    SplitS,
    Start,
    TimeTolerance,
    Tolerance,
    Topics,
    bag_errors,
    opened,
    selection,
    size_text,
    tolerances,
)
from composer.cli.support.errors import FAILED
from composer.cli.support.options import Json, command_group, examples
from composer.cli.support.ros import require_ros
from composer.cli.support.terminal import as_json, lines, write

if TYPE_CHECKING:
    from composer.bags.bag import Bag
    from composer.bags.editing import Selection

bag_app = command_group("Inspect, cut, join and compare bags of ROS 2.")


@bag_app.command("info", epilog=examples("compose bag info recording"))
def info(bag: BagPath, *, json: Json = False) -> None:
    """Print the topics of a bag, its length and its size."""
    with bag_errors():
        found = opened(bag)
        attached = [item.name for item in found.attachments()]
    summary = found.summary
    size = sum(Path(path).stat().st_size for path in found.files)
    if json:
        topics = [
            {**asdict(topic), "definition": None, "messages": summary.counts.get(name, 0)}
            for name, topic in sorted(summary.topics.items())
        ]
        facts = {"files": found.files, "size_bytes": size, "start_ns": summary.start_ns}
        write(as_json({**facts, "end_ns": summary.end_ns, "topics": topics, "attached": attached}))
        return
    count = sum(summary.counts.values())
    start = f"{datetime.fromtimestamp(summary.start_ns / 1e9, UTC):%Y-%m-%d %H:%M:%S} UTC"
    shown = [
        f"files:     {', '.join(map(str, found.files))}",
        f"size:      {size_text(size)}",
        f"start:     {start if count else '-'}",
        f"duration:  {summary.duration_s:.3f} s",
        f"messages:  {count}",
    ]
    shown += [f"attached:  {', '.join(attached)}"] if attached else []
    width = max(map(len, summary.topics), default=0)
    for name, topic in sorted(summary.topics.items()):
        shown.append(f"  {name:{width}}  {summary.counts.get(name, 0):8}  {topic.type_name}")
    write(lines(shown))


@bag_app.command("convert", epilog=examples("compose bag convert old.db3 -o new"))
def convert(
    bag: BagPath, output: Output, *, split_mb: SplitMb = None, split_s: SplitS = None
) -> None:
    """Write a bag of any form as MCAP.

    A bag whose writer was killed becomes complete again.
    """
    _write([bag], selection(None, 0.0, None), output, (split_mb, split_s))


@bag_app.command("slice", epilog=examples("compose bag slice run1 -o part --start 10 --duration 5"))
def cut(
    bag: BagPath,
    output: Output,
    *,
    start: Start = 0.0,
    duration: Duration = None,
    topics: Topics = None,
) -> None:
    """Write a part of a bag to a new one."""
    _write([bag], selection(topics, start, duration), output, (None, None))


@bag_app.command("merge", epilog=examples("compose bag merge robot1 robot2 -o both"))
def merge(
    bags: Annotated[list[Path], typer.Argument(metavar="BAG...", help="The bags to join.")],
    output: Output,
    *,
    topics: Topics = None,
) -> None:
    """Write the messages of several bags to a new one.

    The messages are sorted by time.
    """
    _write(bags, selection(topics, 0.0, None), output, (None, None))


@bag_app.command("diff", epilog=examples("compose bag diff golden run1 --tolerance 1e-6"))
def diff(
    expected: BagPath,
    actual: Annotated[Path, typer.Argument(metavar="OTHER", help="The bag to compare with it.")],
    *,
    topics: Topics = None,
    tolerance: Tolerance = 0.0,
    time_tolerance: TimeTolerance = None,
    ignore: Ignore = None,
) -> None:
    """Compare two bags, field by field.

    The n-th message of a topic is compared with its n-th message in the other bag, and the first
    difference of each topic is printed. Times count from the first message of each bag.

    Exit code 1 if there are differences.
    """
    require_ros("compose bag diff")
    with bag_errors():
        from composer.bags.comparing import differences

        ours, theirs = opened(expected), opened(actual)
        chosen = selection(topics, 0.0, None)
        chosen.topics(ours, theirs)
        shift_ns = ours.summary.start_ns - theirs.summary.start_ns
        found = differences(
            chosen.messages(ours),
            (
                item._replace(recorded_ns=item.recorded_ns + shift_ns)
                for item in chosen.messages(theirs)
            ),
            {
                name: topic.type_name
                for bag in (theirs, ours)
                for name, topic in bag.summary.topics.items()
            },
            ours.summary.start_ns,
            tolerances(tolerance, time_tolerance, ignore),
        )
    write(lines(map(str, found)) if found else "the bags are equal")
    if found:
        raise typer.Exit(FAILED)


def _write(
    paths: Sequence[Path], chosen: Selection, folder: Path, split: tuple[float | None, float | None]
) -> None:
    with bag_errors():
        from composer.bags.editing import write_bag
        from composer.bags.writer import split_limits

        bags: list[Bag] = [opened(path) for path in paths]
        writer = write_bag(bags, chosen, folder, split_limits(*split))
    write(f"{writer.count} messages, {size_text(writer.size_bytes)}: {folder}")
