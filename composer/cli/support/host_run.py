"""One run of a system by a command: its clock, its output, its log, its service manager.

What a run needs of ROS is imported when it starts.
"""

from __future__ import annotations

import gc
import math
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from enum import StrEnum
from functools import partial
from typing import TYPE_CHECKING

import typer

from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.terminal import say

if TYPE_CHECKING:
    from composer.bags.system_recording import SystemRecording
    from composer.model import System
    from composer.plan import Plan
    from composer.runtime.clock import Clock
    from composer.runtime.host_options import HostOptions
    from composer.runtime.supervision.events import Outcome


class Time(StrEnum):
    """The values of ``--time``."""

    REAL = "real"
    VIRTUAL = "virtual"


def run_clock(
    time: Time,
    run_for_s: float | None,
    speed: float | None,
    *,
    publish_clock: bool,
    used: Mapping[str, bool],
) -> Clock:
    """Return the clock of a run.

    ``used`` says which options that need other processes are given. Raises UsageError for options
    that have no meaning together.
    """
    from composer.runtime.clock import COMPUTER, VirtualClock

    if time is Time.REAL:
        for option, is_given in {"--speed": speed, "--publish-clock": publish_clock}.items():
            if is_given:
                raise UsageError(f"{option} needs --time virtual")
        return COMPUTER
    if run_for_s is None and speed is None:
        raise UsageError("--time virtual needs --for or --speed: the time would run away")
    for option in (option for option, is_given in used.items() if is_given):
        raise UsageError(
            f"{option} cannot be used with --time virtual: the run takes part in nothing outside"
            " of its process",
            hint="add --publish-clock" if option == "--dashboard" else None,
        )
    return VirtualClock(math.inf if speed is None else speed, is_isolated=not publish_clock)


def run_host(
    system: System,
    plans: tuple[Plan, Plan],
    options: HostOptions,
    recording: SystemRecording | None,
    dashboard: list[str] | None,
) -> Outcome:
    """Run a system, with its plans up and down, and a dashboard if its arguments are given.

    Raises CommandError if it cannot start. Does not return if something hangs at the end.
    """
    gc.disable()  # until the host has its nodes
    from composer.cli.support.console import queued_output
    from composer.cli.support.line_format import console_format
    from composer.cli.support.process import end_now, shown_address
    from composer.cli.support.progress import Progress, RunLog, severity_of, summary
    from composer.model.names import join
    from composer.runtime.host import Host
    from composer.runtime.process import StartRefused
    from composer.runtime.process.instance_lock import ALREADY_RUNS, AlreadyRunning
    from composer.runtime.process.signals import ALIVE, READY, STOPPING, ServiceManager
    from composer.runtime.supervision.events import BroughtUp, Event, Logged, NodeFailed, Stopping

    with ExitStack() as stack:
        stack.enter_context(queued_output())
        is_part = "/" in system.name.value  # a process of a system: robot/perception
        name = join(system.namespace, system.name.value)
        is_child = bool(options.report_key)  # its lines go to the process that has started it
        log = RunLog(name, part=is_part, forwarded=is_child)
        stack.callback(log.close)
        address = None if dashboard is None else stack.enter_context(shown_address(dashboard))
        progress = Progress(sys.stderr, console_format(), address)
        if recording is not None:
            stack.enter_context(recording.running())

        service_manager = ServiceManager()

        def report(event: Event) -> None:
            # The process that has started this one prints the states of its nodes, and which have
            # failed: it decides what follows.
            is_known = not isinstance(event, Logged) and severity_of(event) == "INFO"
            is_known = is_known or (isinstance(event, NodeFailed) and not event.is_tolerated)
            if not is_child or not is_known:
                progress.show(event)
            log.show(event)
            if recording is not None:
                recording.on_event(event)
            if isinstance(event, BroughtUp | Stopping):
                state = READY if isinstance(event, BroughtUp) else STOPPING
                service_manager.send(state, f"STATUS={event}")

        options = replace(options, on_alive=partial(service_manager.send, ALIVE))
        up, down = plans
        host = Host(system, up, down, options, report)
        try:
            outcome = host.run()
        except StartRefused as refusal:
            if options.report_key and isinstance(refusal, AlreadyRunning):
                raise typer.Exit(ALREADY_RUNS) from refusal
            raise CommandError(str(refusal), hint=refusal.hint) from refusal
        if options.process is None or sys.stderr.isatty():
            say(summary(outcome))
    if outcome.hung:
        end_now(outcome.exit_code)
    return outcome
