"""``compose run``: validate, bring up, supervise and shut down a system."""

from __future__ import annotations

import math
import os
import signal
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.commands.stubs import update_typings
from composer.cli.support.errors import CONFIG, UsageError
from composer.cli.support.host_run import Time, run_clock, run_host
from composer.cli.support.name_values import Arguments, print_arguments
from composer.cli.support.options import (
    START_OPTIONS,
    AllOrNothing,
    Autostart,
    AutostartTo,
    LogLevelOption,
    LogSeverity,
    Namespace,
    Settings,
    UseSimTime,
    examples,
    given_options,
    quantity,
)
from composer.cli.support.process import require_dashboard
from composer.cli.support.ros import (
    announce_discovery,
    require_interfaces,
    require_modules,
    require_ros,
)
from composer.cli.support.system_arguments import ShowWarnings, SystemName, runnable_system
from composer.cli.support.terminal import say, write

if TYPE_CHECKING:
    from composer.bags.system_recording import SystemRecording
    from composer.model import Process, System
    from composer.plan import Plan
    from composer.runtime.clock import Clock
    from composer.runtime.host_options import HostOptions

EPILOG = examples(
    "compose run pipeline                                  run an example system until Ctrl-C",
    "compose run systems/pipeline.yaml --for 10            run for ten seconds",
    "compose run pipeline --dry-run                        print the plan; needs no ROS",
    "compose run configurable lidar=ouster cameras=2       set arguments of the system",
    "compose run configurable --help-arguments             list the arguments of a system",
    "compose run pipeline --set planner.max_velocity=0.5   set a parameter",
    "compose run pipeline --namespace /robot1              use another namespace",
    "compose run pipeline --for 10 --fail-on-error         test that no handler fails",
    "compose run pipeline --use-sim-time                   use the time of a simulator",
    "compose run pipeline --autostart inactive             configure nodes, do not activate",
    "compose run pipeline --wait --timeout 10              run in the background",
    "compose run robot.yaml --process perception           run one of its processes alone",
    "compose run pipeline --time virtual --for 60          a minute in a second, always the same",
    "compose run pipeline --time virtual --speed 10 --publish-clock   ten times as fast, for RViz",
    "compose run pipeline --record                         record all topics in a bag",
    "compose run pipeline --dashboard                      watch and control it in the browser",
)


#: The default of ``--timeout`` with ``--wait``.
_WAIT_S = 60.0
#: The parameters of options that other processes of the system do not get.
_ONLY_OF_ONE_PROCESS = (
    *("process", "await_processes", "fail_on_error", "all_or_nothing", "dashboard"),
    *("run_for", "grace"),
)
#: How long the process may take to start, on a busy machine, before its own limits apply.
_START_S = 20.0


def run(
    context: typer.Context,
    system: SystemName,
    arguments: Arguments = None,
    *,
    help_arguments: Annotated[
        bool, typer.Option("--help-arguments", help="List the arguments of the system and exit.")
    ] = False,
    run_for: Annotated[
        float | None,
        quantity("SECONDS", "--for", help="Shut down this long after the end of the bring-up."),
    ] = None,
    time: Annotated[
        Time,
        typer.Option(
            help="'virtual' jumps whenever nothing is left to do: the same run every time. "
            "Needs --for or --speed, and nodes of this process only."
        ),
    ] = Time.REAL,
    speed: Annotated[
        float | None,
        quantity(
            "FACTOR",
            "--speed",
            help="Let virtual time pass this many times as fast as real time.",
            min=0.001,
            show_default="no limit",
        ),
    ] = None,
    publish_clock: Annotated[
        bool,
        typer.Option(
            "--publish-clock",
            help="In virtual time, publish /clock and take part in the ROS graph, which is "
            "isolated otherwise.",
        ),
    ] = False,
    seed: Annotated[
        int | None,
        typer.Option(
            metavar="NUMBER",
            min=0,
            max=2**32 - 1,
            help="Begin the random numbers of 'random' and 'numpy.random' with this seed.",
            show_default="0 in virtual time",
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the plan with its causes and exit.")
    ] = False,
    settings: Settings = None,
    namespace: Namespace = None,
    use_sim_time: UseSimTime = False,
    autostart: AutostartTo = None,
    log_level: LogLevelOption = None,
    tracing: Annotated[
        bool,
        typer.Option("--tracing/--no-tracing", help="Record callback timings for 'compose top'."),
    ] = True,
    check_mutation: Annotated[
        bool,
        typer.Option(
            "--check-mutation",
            help="Report callbacks that modify published or received messages. Slow.",
        ),
    ] = False,
    fail_on_error: Annotated[
        bool,
        typer.Option(
            "--fail-on-error",
            help="Exit with code 1 if a handler has raised an error or a call has failed.",
        ),
    ] = False,
    all_or_nothing: AllOrNothing = False,
    record: Annotated[
        bool,
        typer.Option(
            "--record",
            help="Record what the nodes publish, in a new folder of 'bags' or as declared.",
        ),
    ] = False,
    dashboard: Annotated[
        bool,
        typer.Option(
            "--dashboard",
            help="Start 'compose dashboard' as well, and print the address of its page.",
        ),
    ] = False,
    wait: Annotated[
        bool, typer.Option("--wait", help="Run in the background; return once the system is up.")
    ] = False,
    timeout: Annotated[
        float | None,
        quantity(
            "SECONDS",
            "--timeout",
            help="Maximum time for the bring-up; then the system is shut down.",
            show_default="no limit; 60 with --wait",
        ),
    ] = None,
    process: Annotated[
        str | None,
        typer.Option(
            "--process",
            metavar="NAME",
            help="Run only this process of the system; 'compose run' without --process brings up "
            "its nodes.",
        ),
    ] = None,
    await_processes: Annotated[
        bool,
        typer.Option(
            "--await-processes",
            help="Start no other process of the system; wait until something else starts them.",
        ),
    ] = False,
    grace: Annotated[
        float, quantity("SECONDS", "--grace", help="Maximum time for shutdown.")
    ] = 10.0,
) -> None:
    """Run a system.

    The system is validated first, and nothing is started if it has errors. All nodes run in this
    process, except for executables and for nodes of other processes: 'compose run' starts both.
    Nodes start in dependency order and shut down in reverse order. If a node fails, its
    'on_failure' applies, during bring-up as well: nodes that do not depend on it start. Press
    Ctrl-C to shut down.

    Exit code 1 if the bring-up fails or a required node is down at the end, 78 if the system has
    errors or lacks an interface package. Errors of handlers are reported in the summary; use
    --fail-on-error in tests.
    """
    if help_arguments:
        print_arguments(system)
        return
    is_part = process is not None
    used = {"--wait": wait, "--process": is_part, "--dashboard": dashboard and not publish_clock}
    clock = run_clock(time, run_for, speed, publish_clock=publish_clock, used=used)
    from composer.cli.support.c_streams import C_STREAMS

    C_STREAMS.redirect()  # before libraries of ROS are loaded
    warnings = ShowWarnings.COUNT if dry_run else ShowWarnings.ALL
    import composer.loading  # noqa: F401 - importing its extension modules would wait for the thread
    from composer.runtime.process.libraries import loading_libraries

    # A process of a system may have environment variables of its own, which have to be set first.
    is_loading_ros = process is None and not dry_run and not wait
    with loading_libraries() if is_loading_ros else nullcontext():
        runnable = runnable_system(
            system,
            arguments,
            settings=settings,
            namespace=namespace,
            use_sim_time=use_sim_time,
            # The coordinating process prints the warnings.
            warnings=warnings if process is None else ShowWarnings.NONE,
            exit_code=CONFIG,
        )
        if process is None:
            update_typings(runnable.result.project)
    declared = runnable.system
    member = None if process is None else _member(declared, process, await_processes)
    part, up, down = _planned(declared, member, autostart)
    if dry_run:
        if up.steps:
            write(str(up))
        return
    if not wait:
        # Let Ctrl-C end the process at once until the host handles it: while ROS is being imported,
        # a KeyboardInterrupt can be lost or become an ImportError.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    _require(part, dashboard=dashboard)
    if member is None:
        announce_discovery(part)
    passed = (*START_OPTIONS, "seed", "tracing", "check_mutation", "record")
    options = given_options(context, passed)
    start = [*declared.arguments, *options]
    from composer.cli.support.process import compose_command, run_in_background
    from composer.runtime.process.computer import process_start_s
    from composer.runtime.process.instance_lock import REPORT_KEY_VARIABLE

    if wait:
        up_s = _WAIT_S if timeout is None else timeout
        start += [*given_options(context, _ONLY_OF_ONE_PROCESS), "--timeout", str(up_s)]
        limit_s = up_s + grace + _START_S
        write(run_in_background(part.name.value, [system, *start], limit_s))
        return
    host_options = replace(
        _options(run_for, timeout, grace, log_level),
        tracing=tracing,
        check_mutation=check_mutation,
        fail_on_error=fail_on_error,
        all_or_nothing=all_or_nothing,
        process=member,
        report_key=os.environ.pop(REPORT_KEY_VARIABLE, ""),  # not for its own children
        clock=clock,
        seed=seed,
        started_at_s=None if time is Time.VIRTUAL else process_start_s(),
        member_command=() if await_processes else (*compose_command(), "run", system, *start),
    )
    shown = given_options(context, ("settings", "namespace", "autostart"))
    shown += ["--", system, *declared.arguments]
    recording = _recording(part, all_of_it=record, clock=host_options.clock)
    host_options = replace(host_options, recorder=recording)
    outcome = run_host(part, (up, down), host_options, recording, shown if dashboard else None)
    if outcome.exit_code:
        raise typer.Exit(outcome.exit_code)


def _member(system: System, name: str, await_processes: bool) -> Process:
    """Return a process of the system by its name, and set its environment variables."""
    from composer.base.diagnostics import suggestion

    if await_processes:
        raise UsageError("--await-processes cannot be used with --process, which starts no other")
    found = {process.name.value: process for process in system.processes}
    if name not in found:
        hint = suggestion(name, list(found)) or "the system has no 'processes'"
        raise UsageError(f"'{name}' is not a process of system '{system.name}'", hint=hint)
    member = found[name]
    os.environ.update({item.value: value for item, value in member.environment})
    return member


def _planned(
    declared: System, member: Process | None, autostart: Autostart | None
) -> tuple[System, Plan, Plan]:
    """Return what this process runs, and its plans for the bring-up and the tear-down."""
    from composer.model import PrimaryState, member_system
    from composer.plan import bring_up, start_goals, tear_down

    goal = None if autostart is None else PrimaryState(autostart.value)
    if member is None:
        return declared, bring_up(declared, goal), tear_down(declared)
    name = member.name.value
    part = member_system(declared, name, start_goals(declared, PrimaryState.ACTIVE))
    return part, bring_up(part, PrimaryState.UNCONFIGURED), tear_down(declared, name)


def _require(system: System, *, dashboard: bool) -> None:
    """Raise CommandError if something that the run needs is not installed."""
    require_ros("compose run", system)
    require_interfaces(system)
    require_modules(system)
    if dashboard:
        require_dashboard("compose run --dashboard")


def _recording(system: System, *, all_of_it: bool, clock: Clock) -> SystemRecording | None:
    """Return the recording that the system or ``--record`` requests. Raises CommandError."""
    from composer.model.system import Recording

    settings = system.recording
    if all_of_it:
        settings = replace(settings or Recording(), ring_s=None)
    if settings is None:
        return None
    from composer.cli.support.bags import bag_errors

    with bag_errors():
        from composer.bags.system_recording import SystemRecording

        return SystemRecording(system, settings, clock, say)


def _options(
    run_for: float | None, timeout: float | None, grace: float, level: LogSeverity | None
) -> HostOptions:
    from composer.cli.support.process import end_within
    from composer.model import LogLevel
    from composer.runtime.host_options import HostOptions

    return HostOptions(
        run_for_s=run_for,
        bring_up_within_s=math.inf if timeout is None else timeout,
        grace_s=grace,
        log_level=LogLevel.INFO if level is None else LogLevel(level.value),
        end_within=end_within,
        ends_process=True,
    )
