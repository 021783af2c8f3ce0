"""``compose graph``: systems, or what runs, as a diagram."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.failure import Failure, UsageFailure
from composer.cli.support.files import system_file
from composer.cli.support.finite import finite
from composer.cli.support.help import examples
from composer.cli.support.loaded import complete_system, load_system
from composer.cli.support.ros import Timeout
from composer.cli.support.terminal import say, write_bytes

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic
    from composer.graph.scene import Scene
    from composer.model import System

EPILOG = examples(
    "compose graph systems/pipeline.yaml                   Mermaid text, for a README",
    "compose graph pipeline -o pipeline.html               a page to explore, works offline",
    "compose graph pipeline -o pipeline.svg                a picture, no other program needed",
    "compose graph pipeline --view lifecycle -o order.png  who waits for whom",
    "compose graph pipeline -f dot | dot -Tpdf > p.pdf     by Graphviz",
    "compose graph robot.yaml base.yaml -o both.svg        several systems in one picture",
    "compose graph --live -o now.html                      what runs, whoever started it",
)


class Format(StrEnum):
    """What a diagram is written as; as in composer.graph.output, which takes long to import."""

    MERMAID = "mermaid"
    DOT = "dot"
    SVG = "svg"
    PNG = "png"
    JSON = "json"
    HTML = "html"


class View(StrEnum):
    """What a diagram shows; the same as composer.graph.View."""

    NODES = "nodes"
    CONNECTIONS = "connections"
    LIFECYCLE = "lifecycle"
    DEPLOYMENT = "deployment"
    STATES = "states"


class Layout(StrEnum):
    """Who places things; the same as composer.graph.placing.Engine."""

    AUTO = "auto"
    GRAPHVIZ = "graphviz"
    BUNDLED = "bundled"


_BY_ENDING = {
    ".mmd": Format.MERMAID,
    ".mermaid": Format.MERMAID,
    ".dot": Format.DOT,
    ".gv": Format.DOT,
    ".svg": Format.SVG,
    ".png": Format.PNG,
    ".json": Format.JSON,
    ".html": Format.HTML,
    ".htm": Format.HTML,
}

#: What only a declaration tells.
_DECLARED_ONLY = (View.LIFECYCLE, View.DEPLOYMENT)
_LIVE_TIMEOUT_S = 10.0
_MEASURE_S = 2.0


def graph(
    systems: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SYSTEM...",
            help="System files, or names of example systems; several make one picture.",
            show_default=False,
            autocompletion=complete_system,
        ),
    ] = None,
    *,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Write there instead of to stdout; the ending says as what.",
            show_default=False,
        ),
    ] = None,
    output_format: Annotated[
        Format | None,
        typer.Option(
            "--format", "-f", help="Default: by FILE's ending, else mermaid.", show_default=False
        ),
    ] = None,
    view: Annotated[
        View,
        typer.Option(
            help="nodes and what joins them; connections of ports with QoS; lifecycle: who waits"
            " for whom; deployment on executors; states of the lifecycle. A page (html) has all"
            " of them and shows this one first.",
        ),
    ] = View.NODES,
    layout: Annotated[
        Layout,
        typer.Option(
            help="Who places things in svg, png and html: auto is Graphviz where it is installed,"
            " else bundled, which gives the same bytes on every machine.",
        ),
    ] = Layout.AUTO,
    live: Annotated[
        bool, typer.Option("--live", help="Draw what runs in the ROS graph instead of a file.")
    ] = False,
    measure: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            callback=finite,
            help="With --live: how long to count messages; 0: not.",
        ),
    ] = _MEASURE_S,
    timeout: Timeout = _LIVE_TIMEOUT_S,
) -> None:
    """Draw systems. What a finding is about is marked red. Needs no ROS, except --live."""
    chosen = output_format or _format_of(output)
    if output is None and chosen is Format.PNG and sys.stdout.isatty():
        raise UsageFailure("a PNG is nothing for a terminal", hint="-o FILE.png writes it")
    if bool(systems) == live:
        raise UsageFailure(
            "say what to draw: one system or more, or --live", hint="compose graph --help"
        )
    if live and view in _DECLARED_ONLY:
        raise UsageFailure(
            f"--view {view} is about what a file declares; the ROS graph does not tell it",
            hint="with --live: nodes, connections or states",
        )
    scene = _live(timeout, measure) if live else _declared(systems or [])
    drawn = _drawn(scene, chosen, view, layout, live=live)
    if output is None:
        write_bytes(drawn)
    else:
        _save(output, drawn)


def _declared(names: list[str]) -> Scene:
    systems: list[System] = []
    findings: list[Diagnostic] = []
    for name in names:
        loading = load_system(system_file(name), shown=name)
        if loading.system is None:
            raise Failure(f"'{name}' is too broken to be drawn")
        systems.append(loading.system)
        findings.extend(loading.diagnostics)
    from composer.graph import scene_of

    return scene_of(systems, findings)


def _live(timeout_s: float, measure_s: float) -> Scene:
    from composer.cli.support.ros import ros_session

    with ros_session("compose graph --live", timeout_s, carries_messages=True) as (
        session,
        deadline,
    ):
        from composer.graph import live_scene_of
        from composer.remote.snapshot import Observer

        with Observer(session) as observer:
            snapshot = observer.look(deadline)
            return live_scene_of(snapshot, observer.rates(deadline, measure_s))


def _drawn(scene: Scene, form: Format, view: View, layout: Layout, *, live: bool) -> bytes:
    from composer import graph as graphs
    from composer.graph import mermaid, output
    from composer.graph.graphviz import GraphvizFailed
    from composer.graph.png import PngMissing

    views = [view]
    if form is Format.HTML:
        views = [each for each in View if not (live and each in _DECLARED_ONLY)]
    pictures = [graphs.build_graph(scene, graphs.View(each.value)) for each in views]
    if form is Format.MERMAID and mermaid.is_too_large(pictures[0]):
        say("Mermaid's viewers refuse a diagram of this size; FILE.html and FILE.svg have no limit")
    target = (output.Format(form.value), output.Engine(layout.value))
    try:
        return output.render(pictures, *target, shown=views.index(view))
    except GraphvizFailed as error:
        raise Failure(str(error), hint="--layout bundled needs no Graphviz") from error
    except PngMissing as error:
        raise Failure(str(error)) from error


def _format_of(output: Path | None) -> Format:
    if output is None:
        return Format.MERMAID
    found = _BY_ENDING.get(output.suffix.lower())
    if found is None:
        raise UsageFailure(
            f"'{output}' does not say what to write", hint="endings: " + " ".join(_BY_ENDING)
        )
    return found


def _save(output: Path, drawn: bytes) -> None:
    try:
        output.write_bytes(drawn)
    except OSError as error:
        raise Failure(f"cannot write '{output}': {error.strerror}") from error
    say(f"wrote {output}")
