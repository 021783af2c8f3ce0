"""``compose record``: write the messages of topics into a bag."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.bags import SplitMb, SplitS, Topics, bag_errors, show_progress, size_text
from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.options import DEFAULT_TIMEOUT_S, Timeout, examples, quantity
from composer.cli.support.ros import ros_session
from composer.cli.support.system_arguments import AnyRunningSystem, running_system_name
from composer.cli.support.terminal import say, write

if TYPE_CHECKING:
    from composer.bags.recorder import Recorder
    from composer.bags.ros_graph import GraphRecording
    from composer.bags.writer import BagWriter
    from composer.client.session import Deadline, Session
    from composer.runtime.ros.endpoints import TopicInfo

EPILOG = examples(
    "compose record                               all topics, until Ctrl-C",
    "compose record pipeline -o run1 --for 60     what nodes of a system publish, for a minute",
    "compose record --topics /scan --topics '/motors/*'",
    "compose record pipeline --now                let its flight recorder write a bag",
)
_UPDATE_S = 0.25
_PROGRESS_S = 1.0


def record(
    system: AnyRunningSystem = None,
    *,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FOLDER",
            help="The folder of the new bag.",
            show_default="a name with the time",
        ),
    ] = None,
    topics: Topics = None,
    services: Annotated[
        list[str] | None,
        typer.Option(
            "--services",
            metavar="PATTERN",
            help="Services with this full name, if their nodes publish service events. Repeatable.",
            show_default="all",
        ),
    ] = None,
    actions: Annotated[
        list[str] | None,
        typer.Option(
            "--actions",
            metavar="PATTERN",
            help="Actions with this full name: feedback and states of goals. Repeatable.",
            show_default="all",
        ),
    ] = None,
    run_for: Annotated[
        float | None,
        quantity("SECONDS", "--for", help="Stop after this time.", show_default="until Ctrl-C"),
    ] = None,
    now: Annotated[
        bool, typer.Option("--now", help="Let the flight recorder of a running system write a bag.")
    ] = False,
    split_mb: SplitMb = None,
    split_s: SplitS = None,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Record topics in a bag.

    A bag is a folder with MCAP files, which rosbag2 and Foxglove read as well. Without SYSTEM,
    topics of all nodes are recorded. Subscriptions have a QoS profile that matches all publishers,
    and latched messages are included. Topics that appear later are added.

    Without --topics, --services and --actions, everything is recorded; with one of them, only what
    they select.

    'compose run --record' and the key 'recording' of a system record inside the process of the
    system, at less cost.
    """
    if now:
        others = (topics, services, actions, output, run_for, split_mb, split_s)
        if system is None or any(item is not None for item in others):
            raise UsageError("--now takes a running system, and no other option")
        _save(system, timeout)
        return
    with (
        bag_errors(),
        ros_session("compose record", timeout, carries_messages=True) as (
            session,
            deadline,
        ),
    ):
        from composer.bags.system_recording import attachments, new_folder
        from composer.bags.writer import BagWriter, split_limits
        from composer.client.session import Deadline

        patterns = {"topics": topics, "services": services, "actions": actions}
        chosen = {kind: found or [] for kind, found in patterns.items()}
        is_wanted = _chosen(session, deadline, system, chosen)
        folder = output or new_folder(Path(), "recording" if system is None else system)
        writer = BagWriter(folder, split_limits(split_mb, split_s), attachments(None))
        until = Deadline(float("inf") if run_for is None else run_for)
        _record(session, writer, is_wanted, until)


def _save(system: str, timeout_s: float) -> None:
    with ros_session("compose record", timeout_s) as (session, deadline):
        from composer.client.systems.managers import Systems

        systems = Systems(session, deadline)
        name = systems.find(running_system_name(system))
        success, message = systems.save_recording(name)
    if not success:
        hint = "set 'ring_s' in the 'recording' of the system, and run it again"
        raise CommandError(f"{name} did not record: {message}", hint=hint)
    write(message)


def _chosen(
    session: Session, deadline: Deadline, system: str | None, patterns: Mapping[str, list[str]]
) -> Callable[[TopicInfo], bool]:
    """Return which topics to record. Raises RosError if there is no such system."""
    from composer.model.system import is_chosen

    if system is None:
        return lambda info: is_chosen(info.name, patterns)
    from composer.client.systems.managers import Systems

    systems = Systems(session, deadline)
    report = systems.report(systems.find(running_system_name(system)))
    nodes = {node.node for node in report.nodes}
    systems.close()
    return lambda info: (
        is_chosen(info.name, patterns) and any(end.node in nodes for end in info.publishers)
    )


def _record(
    session: Session, writer: BagWriter, is_wanted: Callable[[TopicInfo], bool], until: Deadline
) -> None:
    """Record until Ctrl-C. Raises BagError."""
    from composer.bags.bag import BagError
    from composer.bags.recorder import Recorder
    from composer.bags.ros_graph import GraphRecording
    from composer.runtime.clock import COMPUTER

    say(f"recording in {writer.folder}; press Ctrl-C to stop")
    recorder = Recorder(writer, COMPUTER)
    recording = GraphRecording(session, recorder, is_wanted, say)
    with recorder:
        try:
            _receive(session, recorder, recording, writer, until)
        except KeyboardInterrupt:
            pass
        finally:
            recording.close()
    show_progress("")
    if recorder.problem is not None:
        raise BagError(recorder.problem, "what was written before can be read")
    write(_facts(writer, recorder))


def _receive(
    session: Session,
    recorder: Recorder,
    recording: GraphRecording,
    writer: BagWriter,
    until: Deadline,
) -> None:
    from composer.client.session import Deadline

    next_progress, last_count = Deadline(_PROGRESS_S), 0
    while not until.passed and recorder.problem is None:
        recording.update()
        pause = until.at_most(_UPDATE_S)
        while not pause.passed:
            session.spin_once(pause)
        if next_progress.passed:
            rate = (writer.count - last_count) / _PROGRESS_S
            show_progress(f"{_facts(writer, recorder)}, {rate:.0f} messages/s")
            next_progress, last_count = Deadline(_PROGRESS_S), writer.count


def _facts(writer: BagWriter, recorder: Recorder) -> str:
    return (
        f"{writer.count} messages, {size_text(writer.size_bytes)},"
        f" {recorder.dropped} dropped: {writer.folder}"
    )
