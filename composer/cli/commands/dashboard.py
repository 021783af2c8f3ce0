"""``compose dashboard``: show and control running systems in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.name_values import Arguments
from composer.cli.support.options import Autostart, AutostartTo, Namespace, Settings, examples
from composer.cli.support.process import (
    end_now,
    follow_parent,
    foxglove_line,
    report_address,
    require_dashboard,
)
from composer.cli.support.ros import require_ros
from composer.cli.support.system_arguments import (
    LoadOptions,
    ShowWarnings,
    complete_system,
    example_systems,
    path_exists,
    project_systems,
    runnable_system,
)
from composer.cli.support.terminal import say, write

if TYPE_CHECKING:
    from composer.dashboard.context import Declared

EPILOG = examples(
    "compose dashboard                            the whole ROS graph",
    "compose dashboard systems/pipeline.yaml      with source lines, plan and drift",
    "compose dashboard --open                     open the browser",
    "compose dashboard --read-only                change nothing",
    "compose dashboard --host 0.0.0.0 --token-file token    for other computers",
)
_HIGHEST_PORT = 65535


def dashboard(
    system: Annotated[
        str | None,
        typer.Argument(
            metavar="[SYSTEM]",
            help="The file of a system, or the name of a running or an example system.",
            autocompletion=complete_system,
        ),
    ] = None,
    arguments: Arguments = None,
    *,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="The address to listen on.")
    ] = "127.0.0.1",
    port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=_HIGHEST_PORT,
            help="The port to listen on; 0 is any free port.",
            show_default="8800, or the next free one",
        ),
    ] = None,
    open_browser: Annotated[
        bool, typer.Option("--open", help="Open the page in the browser.")
    ] = False,
    token_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Read the token from a private FILE instead of generating one."
        ),
    ] = None,
    read_only: Annotated[
        bool, typer.Option("--read-only", help="Refuse every request that changes something.")
    ] = False,
    foxglove: Annotated[
        bool,
        typer.Option("--foxglove/--no-foxglove", help="Serve Foxglove and Lichtblick as well."),
    ] = True,
    settings: Settings = None,
    namespace: Namespace = None,
    autostart: AutostartTo = None,
) -> None:
    """Show and control running systems in the browser.

    Prints the address of the page, and the address for Foxglove and Lichtblick. Both contain a
    token that is new for each start. Press Ctrl-C to stop.

    The dashboard shows the whole ROS graph. With the file of a system, it also shows source lines,
    the plan, and the differences between the file and the running system.

    It joins the ROS graph only while a browser is connected, and subscribes to what is on the
    screen.
    """
    descriptor = follow_parent()
    require_dashboard("compose dashboard")
    options: LoadOptions = {"settings": settings, "namespace": namespace}
    declared = None if system is None else _declared(system, arguments, options, autostart)
    require_ros("compose dashboard", None if declared is None else declared.system)
    from composer.dashboard.access import InvalidTokenFileError
    from composer.dashboard.context import Options
    from composer.dashboard.start import Address, NotPrivateError, run_dashboard
    from composer.dashboard.web.server import PortInUseError

    def on_ready(url: str) -> None:
        if descriptor is not None:
            report_address(descriptor, url)
            return
        write(url)
        if foxglove:
            write(foxglove_line(url))
        if open_browser:
            _open(url)

    try:
        run_dashboard(
            Address(host, port, token_file),
            Options(system or "", read_only, foxglove),
            declared,
            on_ready,
        )
    except NotPrivateError as error:
        hint = "it protects the dashboard from other computers: openssl rand -hex 32 > token"
        raise UsageError(str(error), hint=hint) from error
    except (InvalidTokenFileError, PortInUseError) as error:
        raise CommandError(str(error)) from error
    end_now(0)  # threads of ROS may hang


def _open(url: str) -> None:
    """Open the page, on another thread: some browsers run until the user leaves them."""
    import threading
    import webbrowser

    def run() -> None:
        if not webbrowser.open(url):
            say("dashboard: the browser cannot be opened, so open the address yourself")

    threading.Thread(target=run, name="browser", daemon=True).start()


def _declared(
    text: str, arguments: list[str] | None, options: LoadOptions, autostart: Autostart | None
) -> Declared | None:
    """Return the system of a file; None for the name of a running system without a known file."""
    from composer.dashboard.context import Declared
    from composer.model import PrimaryState

    is_file = path_exists(Path(text)) or text.endswith((".yaml", ".yml"))
    if not is_file and text.rpartition("/")[2] not in {**project_systems(), **example_systems()}:
        return None
    name = text if is_file else text.rpartition("/")[2]
    options["warnings"] = ShowWarnings.ALL
    system, path, result = runnable_system(name, arguments, **options)
    goal = PrimaryState(autostart.value) if autostart is not None else None
    return Declared(system, str(path), tuple(result.diagnostics), goal)
