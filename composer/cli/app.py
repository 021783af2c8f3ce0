"""The commands of ``compose``, put together. A new command is a file here and a line below."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from composer.cli import (
    action,
    doctor,
    graph,
    interface,
    lifecycle,
    node,
    param,
    rule,
    run,
    schema,
    service,
    topic,
    validate,
)
from composer.cli.help import examples
from composer.cli.terminal import write

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(asked: bool) -> None:
    if asked:
        from composer.report.tool import tool_version

        write(f"compose {tool_version()}")
        raise typer.Exit


def _set_debug(asked: bool) -> None:
    if asked:
        os.environ["COMPOSE_DEBUG"] = "1"


@app.callback(
    epilog=examples(
        "compose run pipeline                        run an example system",
        "compose run systems/pipeline.yaml           validate, bring up, keep up, tear down",
        "compose validate systems nodes              every finding in one run",
        "compose lifecycle set planner deactivate    from another terminal",
        "compose graph systems/pipeline.yaml         a diagram, as Mermaid text",
    )
)
def compose(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
    debug: Annotated[
        bool,
        typer.Option(
            "--debug",
            callback=_set_debug,
            help="Show the traceback of an internal error (also: COMPOSE_DEBUG=1).",
        ),
    ] = False,
) -> None:
    """Declare, prove and run a ROS 2 system.

    YAML says what the system is; compose checks it before anything starts, runs it as real
    lifecycle nodes in one process, and lets any ROS 2 tool see it.

    Exit codes: 0 clean, 1 findings or a node failed, 2 usage, 3 internal error.
    """


app.command("run", epilog=run.EPILOG)(run.run)
app.command("validate", epilog=validate.EPILOG)(validate.validate)
app.command("graph", epilog=graph.EPILOG)(graph.graph)
app.add_typer(lifecycle.app, name="lifecycle")
app.add_typer(node.app, name="node")
app.add_typer(topic.app, name="topic")
app.add_typer(service.app, name="service")
app.add_typer(action.app, name="action")
app.add_typer(param.app, name="param")
app.add_typer(interface.app, name="interface")
app.command("doctor", epilog=doctor.EPILOG)(doctor.doctor)
app.command("rule", epilog=rule.EPILOG)(rule.rule)
app.command("schema", epilog=schema.EPILOG)(schema.schema)
