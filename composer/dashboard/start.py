"""Starts one dashboard: the token, the socket, the server, and the end of the process."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.dashboard.access import Access, is_loopback, new_token, read_token
from composer.dashboard.context import Dashboard, Declared, Options
from composer.dashboard.feeds import Feeds
from composer.dashboard.forms import Forms
from composer.dashboard.recordings import RECORDINGS
from composer.dashboard.ros_side import RosSide
from composer.dashboard.web.app import make_app
from composer.dashboard.web.server import listen, serve
from composer.interfaces import Interfaces
from composer.project import Project
from composer.project.node_types import interface_folders

#: On a busy computer. A participant that does not leave stays in the graph of others for 20 s.
_LEAVES_WITHIN_S = 5.0


class NotPrivateError(Exception):
    """Other computers could use the dashboard, but the token is not of the user's choice."""


@dataclass(frozen=True, slots=True)
class Address:
    """Where to listen: ``port`` None is the default port or the next that is free."""

    host: str = "127.0.0.1"
    port: int | None = None
    token_file: Path | None = None


def run_dashboard(
    address: Address, options: Options, declared: Declared | None, on_ready: Callable[[str], None]
) -> None:
    """Serve until a signal; ``on_ready`` gets the URL with the token.

    Raises NotPrivateError, InvalidTokenFileError, PortInUseError.
    """
    if not is_loopback(address.host) and address.token_file is None:
        raise NotPrivateError(f"--host {address.host} needs --token-file")
    token = new_token() if address.token_file is None else read_token(address.token_file)
    listening = listen(address.host, address.port)
    port = int(listening.getsockname()[1])
    feeds = Feeds()
    interfaces = Interfaces.load(interface_folders(Project.at(Path.cwd())))
    ros = RosSide(feeds, Forms(interfaces))
    dashboard = Dashboard(
        options=options,
        access=Access(token, address.host, port),
        declared=declared,
        ros=ros,
        feeds=feeds,
        interfaces=interfaces,
    )
    url = f"http://{_in_url(address.host)}:{port}/?token={token}"

    def prepare() -> None:
        on_ready(url)
        ros.prepare()

    try:
        serve(make_app(dashboard), listening, prepare)
    finally:
        RECORDINGS.close()
        ros.close(_LEAVES_WITHIN_S)


def _in_url(host: str) -> str:
    """Return a host as a browser on this computer can open it."""
    if host in ("0.0.0.0", "::"):  # noqa: S104 - compared, not bound
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
