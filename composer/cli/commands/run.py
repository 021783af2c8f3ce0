"""``compose run``: validate, plan, bring up, keep up, tear down."""

from __future__ import annotations

import math
import signal
import sys
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.failure import FINDINGS, Failure
from composer.cli.support.files import system_file
from composer.cli.support.finite import finite
from composer.cli.support.hard_exit import end_now, end_within
from composer.cli.support.help import examples
from composer.cli.support.loaded import Namespace, SystemName, load_system
from composer.cli.support.ros import require_interfaces, require_ros
from composer.cli.support.terminal import say, write

if TYPE_CHECKING:
    from composer.model import System
    from composer.plan import Plan
    from composer.runtime.host import HostOptions
    from composer.runtime.supervision.events import Outcome

EPILOG = examples(
    "compose run pipeline                                  an example system, until Ctrl-C",
    "compose run systems/pipeline.yaml --for 10            ten seconds",
    "compose run pipeline --dry-run                        the plan only, needs no ROS",
    "compose run pipeline --set planner.max_velocity=0.5   another parameter value",
    "compose run pipeline --namespace /robot1",
    "compose run pipeline --use-sim-time                   with a simulator that publishes /clock",
    "compose run pipeline --autostart inactive             then: compose lifecycle set ...",
    "compose run pipeline --wait --timeout 10              in the background, once it is up",
)

#: How long ``--wait`` waits when nobody says it.
_WAIT_S = 60.0
#: What a process may need before it keeps limits by itself, on a busy machine.
_START_S = 20.0


class Autostart(StrEnum):
    """How far nodes are brought up."""

    ACTIVE = "active"
    INACTIVE = "inactive"
    UNCONFIGURED = "unconfigured"


class Level(StrEnum):
    """rcl's severities."""

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
            help="Stop by itself after so long.",
            show_default=False,
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the plan and its causes, start nothing.")
    ] = False,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NODE.PARAMETER=VALUE",
            help="Override a parameter; repeatable.",
            show_default=False,
        ),
    ] = None,
    namespace: Namespace = None,
    use_sim_time: Annotated[
        bool,
        typer.Option(
            "--use-sim-time",
            help="Let the time of all nodes that say nothing else be that of /clock.",
        ),
    ] = False,
    autostart: Annotated[
        Autostart | None,
        typer.Option(help="How far to bring the nodes up.", show_default="as the file says"),
    ] = None,
    log_level: Annotated[Level, typer.Option(help="What nodes log.")] = Level.INFO,
    tracing: Annotated[
        bool,
        typer.Option(
            "--tracing/--no-tracing",
            help="Take the times of callbacks, for 'compose top'. Off only to measure its cost.",
        ),
    ] = True,
    check_mutation: Annotated[
        bool,
        typer.Option(
            "--check-mutation",
            help="Name callbacks that change what was published or received. Slow.",
        ),
    ] = False,
    wait: Annotated[
        bool,
        typer.Option("--wait", help="Run in the background, and return once the system is up."),
    ] = False,
    timeout: Annotated[
        float | None,
        typer.Option(
            "--timeout",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="Take the system down again if it is not up by then.",
            show_default="none, 60 with --wait",
        ),
    ] = None,
    grace: Annotated[
        float,
        typer.Option(
            "--grace",
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="How long the end may take at the most.",
        ),
    ] = 10.0,
) -> None:
    """Run a system: all nodes in this process, up in dependency order, down in reverse.

    Ctrl-C stops it. Exit code 1 when the system has errors (nothing is started then), when it does
    not come up (what was started is taken back then), or a node failed for good.
    """
    declared = _load(system, settings or [], namespace, use_sim_time=use_sim_time)
    from composer.model import PrimaryState
    from composer.plan import bring_up

    plan = bring_up(declared, PrimaryState(autostart.value) if autostart is not None else None)
    if dry_run:
        if plan.steps:
            write(str(plan))
        return
    if not wait:
        # Nothing has begun, so Ctrl-C may end the process at once until the host hears it: raised
        # while ROS is being loaded, it can be taken for a failure of that, or be lost.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    require_ros("compose run")
    require_interfaces(declared)
    if wait:
        from composer.cli.support.background import run_in_background

        up_s = _WAIT_S if timeout is None else timeout
        given = _arguments(system, settings or [], namespace, autostart, log_level)
        given += ["--use-sim-time"] if use_sim_time else []
        given += [] if tracing else ["--no-tracing"]
        given += ["--check-mutation"] if check_mutation else []
        limits = _numbers({"--for": run_for, "--timeout": up_s, "--grace": grace})
        limit_s = up_s + grace + _START_S
        write(run_in_background(declared.name.value, [*given, *limits], limit_s))
        return
    options = _options(run_for, timeout, grace, log_level)
    options = replace(options, tracing=tracing, check_mutation=check_mutation)
    outcome = _run(declared, plan, options)
    if outcome.exit_code:
        raise typer.Exit(outcome.exit_code)


def _load(text: str, settings: list[str], namespace: str | None, *, use_sim_time: bool) -> System:
    path = system_file(text)
    loading = load_system(
        path,
        shown=text,
        settings=settings,
        namespace=namespace,
        use_sim_time=use_sim_time,
    )
    if loading.system is not None and loading.system.node_type:
        raise Failure(
            f"'{text}' is a node type, not a system",
            hint="a system names it under 'nodes:'; compose validate checks it alone",
        )
    if loading.system is None or not loading.is_runnable:
        raise typer.Exit(FINDINGS)
    return loading.system


def _arguments(
    system: str,
    settings: list[str],
    namespace: str | None,
    autostart: Autostart | None,
    level: Level,
) -> list[str]:
    """Return the command line that says the same once more."""
    arguments = [system, "--log-level", level.value]
    for setting in settings:
        arguments += ["--set", setting]
    if namespace is not None:
        arguments += ["--namespace", namespace]
    if autostart is not None:
        arguments += ["--autostart", autostart.value]
    return arguments


def _numbers(options: dict[str, float | None]) -> list[str]:
    given = {name: value for name, value in options.items() if value is not None}
    return [text for name, value in given.items() for text in (name, repr(value))]


def _run(system: System, plan: Plan, options: HostOptions) -> Outcome:
    from composer.cli.support.progress import Progress, summary
    from composer.plan import tear_down
    from composer.runtime.host import Host
    from composer.runtime.process import StartRefused

    progress = Progress(sys.stderr)
    host = Host(system, plan, tear_down(system), options, progress.show)
    try:
        outcome = host.run()
    except StartRefused as refusal:
        raise Failure(str(refusal), hint=refusal.hint) from refusal
    say(summary(outcome))
    if outcome.hung:
        end_now(outcome.exit_code)
    return outcome


def _options(
    run_for: float | None, timeout: float | None, grace: float, level: Level
) -> HostOptions:
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
