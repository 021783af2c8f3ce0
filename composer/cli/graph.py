"""``compose graph``: a system as a diagram."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from composer.cli.failure import Failure, UsageFailure
from composer.cli.files import system_file
from composer.cli.help import examples
from composer.cli.loaded import SystemName, load_system
from composer.cli.terminal import say, write_raw

EPILOG = examples(
    "compose graph systems/pipeline.yaml                   Mermaid text, for a README",
    "compose graph pipeline -o pipeline.svg                a picture, no other program needed",
    "compose graph pipeline --view lifecycle -o order.png  who waits for whom",
    "compose graph pipeline -f dot | dot -Tpdf > p.pdf     by Graphviz",
)


class Format(StrEnum):
    """What a diagram is written as."""

    MERMAID = "mermaid"
    DOT = "dot"
    JSON = "json"
    SVG = "svg"


class View(StrEnum):
    """What a diagram shows; the same as composer.graph.View, which takes longer to import."""

    NODES = "nodes"
    CONNECTIONS = "connections"
    LIFECYCLE = "lifecycle"
    DEPLOYMENT = "deployment"
    STATES = "states"


_BY_ENDING = {
    ".mmd": Format.MERMAID,
    ".mermaid": Format.MERMAID,
    ".dot": Format.DOT,
    ".gv": Format.DOT,
    ".json": Format.JSON,
    ".svg": Format.SVG,
}


def graph(
    system: SystemName,
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
            " for whom; deployment on executors; states of the lifecycle.",
        ),
    ] = View.NODES,
) -> None:
    """Draw a system. What a finding is about is marked red. Needs no ROS."""
    chosen = output_format or _format_of(output)
    loading = load_system(system_file(system), shown=system)
    if loading.system is None:
        raise Failure(f"'{system}' is too broken to be drawn")
    from composer import graph as graphs

    picture = graphs.build_graph(loading.system, graphs.View(view.value), loading.diagnostics)
    text = graphs.RENDERERS[chosen.value](picture)
    if output is None:
        write_raw(text)
    else:
        _save(output, text)


def _format_of(output: Path | None) -> Format:
    if output is None:
        return Format.MERMAID
    found = _BY_ENDING.get(output.suffix.lower())
    if found is None:
        raise UsageFailure(
            f"'{output}' does not say what to write", hint="endings: " + " ".join(_BY_ENDING)
        )
    return found


def _save(output: Path, text: str) -> None:
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise Failure(f"cannot write '{output}': {error.strerror}") from error
    say(f"wrote {output}")
