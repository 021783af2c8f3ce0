"""``compose run``: validate, bring up, supervise and shut down a system."""

from __future__ import annotations

import math
import os
import signal
import sys
from contextlib import ExitStack
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.dashboard_process import require_dashboard
from composer.cli.support.errors import FAILED, CommandError, UsageError
from composer.cli.support.options import Autostart, Namespace, examples, finite
from composer.cli.support.ros import require_interfaces, require_ros
from composer.cli.support.system_arguments import SystemName, load_system, system_file
from composer.cli.support.terminal import say, write

if TYPE_CHECKING:
    from composer.model import Process, System
    from composer.plan import Plan
    from composer.runtime.host import HostOptions
    from composer.runtime.supervision.events import Outcome

EPILOGS = {
    "run": examples(
        "compose run pipeline                                  run an example system until Ctrl-C",
        "compose run systems/pipeline.yaml --for 10            run for ten seconds",
        "compose run pipeline --dry-run                        print the plan; needs no ROS",
        "compose run pipeline --set planner.max_velocity=0.5   set a parameter",
        "compose run pipeline --namespace /robot1              use another namespace",
        "compose run pipeline --for 10 --fail-on-error         test that no handler fails",
        "compose run pipeline --use-sim-time                   use the time of a simulator",
        "compose run pipeline --autostart inactive             configure nodes, do not activate",
        "compose run pipeline --wait --timeout 10              run in the background",
        "compose run robot.yaml --process perception           run one of its processes alone",
        "compose run pipeline --dashboard                      watch and control it in the browser",
    )
}

#: The default of ``--timeout`` with ``--wait``.
_WAIT_S = 60.0
#: How long the process may take to start, on a busy machine, before its own limits apply.
_START_S = 20.0


class LogSeverity(StrEnum):
    """The log severities of ROS."""

    DEBUG = "debug"
    INFO = "info"
    WARN = "warn"
    ERROR = "error"
    FATAL = "fatal"


def run(
    system: SystemName,
    *,
    run_for: Annotated[
        float | None,
        typer.Option(
            "--for",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Shut down after this time.",
            show_default=False,
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the plan with its causes and exit.")
    ] = False,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NODE.PARAMETER=VALUE",
            help="Override a parameter. Repeatable.",
            show_default=False,
        ),
    ] = None,
    namespace: Namespace = None,
    use_sim_time: Annotated[
        bool,
        typer.Option(
            "--use-sim-time",
            help="Use /clock unless a node sets use_sim_time.",
        ),
    ] = False,
    autostart: Annotated[
        Autostart | None,
        typer.Option(
            help="Bring nodes up to this state.", show_default="as declared in the system"
        ),
    ] = None,
    log_level: Annotated[
        LogSeverity, typer.Option(help="Minimum severity of log messages.")
    ] = LogSeverity.INFO,
    tracing: Annotated[
        bool,
        typer.Option(
            "--tracing/--no-tracing",
            help="Record callback timings for 'compose top'.",
        ),
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
    dashboard: Annotated[
        bool,
        typer.Option(
            "--dashboard",
            help="Start 'compose dashboard' as well, and print the address of its page.",
        ),
    ] = False,
    wait: Annotated[
        bool,
        typer.Option("--wait", help="Run in the background; return once the system is up."),
    ] = False,
    timeout: Annotated[
        float | None,
        typer.Option(
            "--timeout",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Maximum time for the bring-up; then the system is shut down.",
            show_default="no limit; 60 with --wait",
        ),
    ] = None,
    process: Annotated[
        str | None,
        typer.Option(
            "--process",
            metavar="NAME",
            help="Run only this process of the system; 'compose run' without it moves its nodes.",
            show_default=False,
        ),
    ] = None,
    grace: Annotated[
        float,
        typer.Option(
            "--grace",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Maximum time for shutdown.",
        ),
    ] = 10.0,
) -> None:
    """Run a system.

    The system is validated first, and nothing is started if it has errors. All nodes run in this
    process, except for executables and the nodes of other processes, which it starts. They are
    brought up in dependency order and shut down in reverse order. If the bring-up fails, it is
    rolled back. Press Ctrl-C to shut down.

    Exit code 1 if the system has errors, the bring-up fails, or a node fails permanently. Errors of
    handlers are reported in the summary; use --fail-on-error in tests.
    """
    declared = _load(
        system,
        settings or [],
        namespace,
        use_sim_time=use_sim_time,
        only_errors=process is not None,  # the coordinating process prints the warnings
    )
    from composer.model import PrimaryState, member_system
    from composer.plan import bring_up

    member = None if process is None else _member(declared, process)
    if member is not None:
        os.environ.update({name.value: value for name, value in member.environment})
        declared = member_system(declared, member.name.value)
        autostart = Autostart.UNCONFIGURED
    plan = bring_up(declared, PrimaryState(autostart.value) if autostart is not None else None)
    if dry_run:
        if plan.steps:
            write(str(plan))
        return
    if not wait:
        # Let Ctrl-C end the process at once until the host handles it: while ROS is being imported,
        # a KeyboardInterrupt can be lost or become an ImportError.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    require_ros("compose run")
    require_interfaces(declared)
    switches = ["--use-sim-time"] if use_sim_time else []
    switches += [] if tracing else ["--no-tracing"]
    switches += ["--check-mutation"] if check_mutation else []
    if dashboard:
        require_dashboard("compose run --dashboard")
    if wait:
        from composer.cli.support.process import run_in_background

        up_s = _WAIT_S if timeout is None else timeout
        given = _arguments(system, settings or [], namespace, autostart, log_level)
        given += switches
        given += ["--fail-on-error"] if fail_on_error else []
        given += [] if process is None else ["--process", process]
        given += ["--dashboard"] if dashboard else []
        limits = _numbers({"--for": run_for, "--timeout": up_s, "--grace": grace})
        limit_s = up_s + grace + _START_S
        write(run_in_background(declared.name.value, [*given, *limits], limit_s))
        return
    options = _options(run_for, timeout, grace, log_level)
    from composer.cli.support.process import compose_command

    given = _arguments(system, settings or [], namespace, None, log_level)
    options = replace(
        options,
        tracing=tracing,
        check_mutation=check_mutation,
        fail_on_error=fail_on_error,
        process=member,
        member_command=(*compose_command(), "run", *given, *switches),
    )
    shown = _dashboard_arguments(system, settings or [], namespace, autostart)
    outcome = _run(declared, plan, options, shown if dashboard else None)
    if outcome.exit_code:
        raise typer.Exit(outcome.exit_code)


def _load(
    text: str,
    settings: list[str],
    namespace: str | None,
    *,
    use_sim_time: bool,
    only_errors: bool,
) -> System:
    path = system_file(text)
    result = load_system(
        path,
        shown=text,
        settings=settings,
        namespace=namespace,
        use_sim_time=use_sim_time,
        only_errors=only_errors,
    )
    if result.system is not None and result.system.node_type:
        raise CommandError(
            f"'{text}' is a node type, not a system",
            hint="use it in a system under 'nodes:'; 'compose validate' checks it on its own",
        )
    if result.system is None or not result.is_runnable:
        raise typer.Exit(FAILED)
    return result.system


def _member(system: System, name: str) -> Process:
    """Return a process of the system by its name."""
    from composer.diagnostics import suggestion

    found = {process.name.value: process for process in system.processes}
    if name not in found:
        hint = suggestion(name, list(found)) or "the system has no 'processes'"
        raise UsageError(f"'{name}' is not a process of system '{system.name}'", hint=hint)
    return found[name]


def _arguments(
    system: str,
    settings: list[str],
    namespace: str | None,
    autostart: Autostart | None,
    level: LogSeverity,
) -> list[str]:
    """Return the command line for the process in the background."""
    arguments = [system, "--log-level", level.value]
    for setting in settings:
        arguments += ["--set", setting]
    if namespace is not None:
        arguments += ["--namespace", namespace]
    if autostart is not None:
        arguments += ["--autostart", autostart.value]
    return arguments


def _dashboard_arguments(
    system: str, settings: list[str], namespace: str | None, autostart: Autostart | None
) -> list[str]:
    """Return the arguments of the dashboard that shows this system."""
    arguments = [argument for text in settings for argument in ("--set", text)]
    arguments += [] if namespace is None else ["--namespace", namespace]
    arguments += [] if autostart is None else ["--autostart", autostart.value]
    return [*arguments, "--", system]


def _numbers(options: dict[str, float | None]) -> list[str]:
    given = {name: value for name, value in options.items() if value is not None}
    return [text for name, value in given.items() for text in (name, repr(value))]


def _run(system: System, plan: Plan, options: HostOptions, dashboard: list[str] | None) -> Outcome:
    """Run the system, with a dashboard if its arguments are given."""
    from composer.cli.support.console import queued_output
    from composer.cli.support.dashboard_process import shown_address
    from composer.cli.support.line_format import console_format
    from composer.cli.support.process import end_now
    from composer.cli.support.progress import Progress, summary
    from composer.cli.support.run_logging import run_log
    from composer.names import join
    from composer.plan import tear_down
    from composer.runtime.host import Host
    from composer.runtime.process import StartRefused
    from composer.runtime.supervision.events import Event

    with ExitStack() as stack:
        stack.enter_context(queued_output())
        is_part = "/" in system.name.value  # a process of a system: robot/perception
        name = join(system.namespace, system.name.value)
        log = stack.enter_context(run_log(name, part=is_part))
        address = None if dashboard is None else stack.enter_context(shown_address(dashboard))
        progress = Progress(sys.stderr, console_format(), address)

        def report(event: Event) -> None:
            progress.show(event)
            log.show(event)

        host = Host(system, plan, tear_down(system), options, report)
        try:
            outcome = host.run()
        except StartRefused as refusal:
            raise CommandError(str(refusal), hint=refusal.hint) from refusal
        if options.process is None or sys.stderr.isatty():
            say(summary(outcome))
    if outcome.hung:
        end_now(outcome.exit_code)
    return outcome


def _options(
    run_for: float | None, timeout: float | None, grace: float, level: LogSeverity
) -> HostOptions:
    from composer.cli.support.process import end_within
    from composer.model import LogLevel
    from composer.runtime.host import HostOptions

    return HostOptions(
        run_for_s=run_for,
        bring_up_within_s=math.inf if timeout is None else timeout,
        grace_s=grace,
        log_level=LogLevel(level.value),
        end_within=end_within,
        ends_process=True,
    )
