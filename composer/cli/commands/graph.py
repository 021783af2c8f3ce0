"""``compose graph``: draw systems, or the running ROS graph."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.name_values import complete_system_or_argument, split_arguments
from composer.cli.support.new_files import write_file
from composer.cli.support.options import Timeout, examples, quantity
from composer.cli.support.system_arguments import load_system, system_file
from composer.cli.support.terminal import say, write_bytes
from composer.graph.diagram import FORMATS_BY_SUFFIX, Format, View

if TYPE_CHECKING:
    from composer.base.diagnostics import Diagnostic
    from composer.graph.scene import Scene
    from composer.model import System

EPILOG = examples(
    "compose graph systems/pipeline.yaml                   print Mermaid text",
    "compose graph pipeline -o pipeline.html               write an interactive page",
    "compose graph pipeline -o pipeline.svg                write an image",
    "compose graph pipeline --view lifecycle -o order.png  draw the bring-up order",
    "compose graph frames --view frames -o frames.svg      draw the frames of tf2",
    "compose graph pipeline robot -o both.svg              draw several systems together",
    "compose graph configurable cameras=3 -o three.svg     draw it with these arguments",
    "compose graph --live -o now.html                      draw the running ROS graph",
)

#: Views of what only a file declares.
_DECLARED_ONLY = (View.LIFECYCLE, View.FRAMES)
_LIVE_TIMEOUT_S = 10.0
_MEASURE_S = 2.0


def graph(
    systems: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SYSTEM... [NAME=VALUE]...",
            help="System files or names of example systems, drawn in one diagram, and arguments.",
            autocompletion=complete_system_or_argument,
        ),
    ] = None,
    *,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Write to FILE instead of stdout. Its suffix selects the format.",
        ),
    ] = None,
    output_format: Annotated[
        Format | None,
        typer.Option(
            "--format", "-f", help="Output format. Default: from the suffix of FILE, else mermaid."
        ),
    ] = None,
    view: Annotated[
        View,
        typer.Option(
            help="What to draw. nodes: nodes and their connections. connections: ports and QoS."
            " lifecycle: dependencies between nodes. deployment: nodes by executor, with --live by"
            " process and host. states:"
            " lifecycle states. frames: the tree of frames of tf2. An HTML page contains all views"
            " and opens with this one."
        ),
    ] = View.NODES,
    live: Annotated[
        bool, typer.Option("--live", help="Draw the running ROS graph instead of a file.")
    ] = False,
    measure: Annotated[
        float,
        quantity(
            "SECONDS",
            "--measure",
            help="With --live: time to measure message rates. 0 disables it.",
        ),
    ] = _MEASURE_S,
    timeout: Timeout = _LIVE_TIMEOUT_S,
) -> None:
    """Draw systems as diagrams.

    Parts with errors are marked in red, and those with warnings in yellow. ROS is needed only with
    --live.
    """
    chosen = output_format or _format_of(output)
    if output is None and chosen is Format.PNG and sys.stdout.isatty():
        raise UsageError("refusing to write a PNG to a terminal", hint="use -o FILE.png")
    if bool(systems) == live:
        raise UsageError("specify either systems or --live", hint="see 'compose graph --help'")
    if live and view in _DECLARED_ONLY:
        raise UsageError(
            f"--view {view} needs a system file; the ROS graph does not contain this information",
            hint="use nodes, connections, deployment or states with --live",
        )
    has_processes = view is View.DEPLOYMENT or chosen is Format.HTML
    scene = (
        _live(timeout, measure, has_processes=has_processes) if live else _declared(systems or [])
    )
    if view is View.FRAMES and not scene.transforms:
        raise CommandError("no node declares the frames that it broadcasts, in 'transforms'")
    drawn = _drawn(scene, chosen, view, live=live)
    if output is None:
        write_bytes(drawn)
    else:
        write_file(output, drawn)
        say(f"wrote {output}")


def _declared(names: list[str]) -> Scene:
    systems: list[System] = []
    diagnostics: list[Diagnostic] = []
    names, arguments = split_arguments(names)
    for name in names:
        result = load_system(system_file(name), name, arguments)
        if result.system is None:
            raise CommandError(f"'{name}' cannot be drawn because of its errors")
        systems.append(result.system)
        diagnostics.extend(result.diagnostics)
    from composer.graph.views import scene_of

    return scene_of(systems, diagnostics)


def _live(timeout_s: float, measure_s: float, *, has_processes: bool) -> Scene:
    from composer.cli.support.ros import ros_session

    with ros_session("compose graph --live", timeout_s, carries_messages=True) as (
        session,
        deadline,
    ):
        from composer.client.snapshot import GraphObserver
        from composer.client.systems.process_list import list_processes, observed_processes
        from composer.graph.views import live_scene_of

        with GraphObserver(session) as observer:
            snapshot = observer.snapshot(deadline)
            if has_processes:
                reports, _ = list_processes(session, deadline, callbacks=False)
                snapshot = replace(snapshot, processes=observed_processes(reports))
            return live_scene_of(snapshot, observer.rates(deadline, measure_s))


def _drawn(scene: Scene, form: Format, view: View, *, live: bool) -> bytes:
    from composer.graph import output
    from composer.graph.formats import mermaid
    from composer.graph.views import build_graph

    views = [view]
    if form is Format.HTML:
        unused = _DECLARED_ONLY if live else () if scene.transforms else (View.FRAMES,)
        views = [each for each in View if each not in unused]
    pictures = [build_graph(scene, each) for each in views]
    if form is Format.MERMAID and mermaid.is_too_large(pictures[0]):
        say("warning: Mermaid refuses to render a diagram of this size; use html or svg instead")
    try:
        return output.render(pictures, form, shown=views.index(view))
    except output.PngMissing as error:
        raise CommandError(
            str(error), hint='pip install "ros2-composer[png]"; or use -f svg'
        ) from error


def _format_of(output: Path | None) -> Format:
    if output is None:
        return Format.MERMAID
    found = FORMATS_BY_SUFFIX.get(output.suffix.lower())
    if found is None:
        raise UsageError(
            f"the suffix of '{output}' is not a known format",
            hint="use one of " + " ".join(FORMATS_BY_SUFFIX) + ", or --format",
        )
    return found
