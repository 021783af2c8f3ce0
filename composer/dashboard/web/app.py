"""The routes of the dashboard, behind one check of every request, and the files of the page."""

from __future__ import annotations

import asyncio
import html
import mimetypes
import re
from collections.abc import Awaitable, Callable, MutableMapping
from functools import cache, partial
from http import HTTPStatus
from importlib.resources import files
from importlib.resources.abc import Traversable
from posixpath import dirname, join, normpath
from typing import Any
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.requests import Request as HttpRequest
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from composer.dashboard.access import Refusal, Request
from composer.dashboard.context import Dashboard
from composer.dashboard.foxglove.connection import FoxgloveConnection, FoxgloveServer
from composer.dashboard.foxglove.encoding import SUBPROTOCOLS
from composer.dashboard.protocol.outbox import MAX_CONNECTIONS
from composer.dashboard.web.client import Client
from composer.dashboard.web.connection import Connection

Scope = MutableMapping[str, Any]
AsgiReceive = Callable[[], Awaitable[MutableMapping[str, Any]]]
AsgiSend = Callable[[MutableMapping[str, Any]], Awaitable[None]]

_TRY_AGAIN_LATER = 1013
_METHODS = ("GET", "HEAD")
#: The addresses of the views; the page reads the rest of the path.
VIEWS = ("graph", "nodes", "topics", "services", "actions", "parameters", "log", "timing", "bags")
#: The page shares a folder with Python code.
_SUFFIXES = (".css", ".html", ".js", ".svg", ".txt", "LICENSE")
_MAX_PATH = 200
_WITHOUT_FOXGLOVE = Refusal(404, "the dashboard was started with --no-foxglove")
_NO_SUBPROTOCOL = Refusal(
    400, f"the WebSocket must have the subprotocol {' or '.join(SUBPROTOCOLS)}"
)
PAGE = files("composer.dashboard") / "page"
#: Scripts and styles that the page shares with the pages of ``compose graph``.
GRAPH_FILES = files("composer.graph.formats.html")
_GRAPH_FOLDER = "graph/"
_IMPORT = re.compile(r'^(?:import|export)\b[^;"]*"(\.\.?/[^"]+)"', re.MULTILINE)
_MAIN = "main.js"
#: Later ones replace rules of those before them.
_STYLES = (
    "vendor/uplot/uPlot.min.css",
    *("style/base.css", "style/controls.css", "style/views.css"),
    *("graph/picture.css", "style/graph.css"),
)
#: Views that are shown by the module of another one.
_SHARED = {"": "graph", "actions": "services"}


def make_app(dashboard: Dashboard) -> AccessCheck:
    """Return the application."""
    connections: set[Client] = set()
    foxglove_server = FoxgloveServer.of(dashboard)

    async def index(request: HttpRequest) -> Response:
        dashboard.ros.enter()
        dashboard.ros.leave()  # the page connects before the dashboard leaves the graph
        return _of_page(index_of(request.url.path.split("/")[1]), "text/html")

    async def page(socket: WebSocket) -> None:
        await socket.accept()
        await serve(socket, partial(Connection, dashboard))

    async def foxglove(socket: WebSocket) -> None:
        if not dashboard.options.foxglove:
            await socket.send_denial_response(refusal_page(_WITHOUT_FOXGLOVE))
            return
        offered = socket.scope["subprotocols"]
        chosen = next((name for name in SUBPROTOCOLS if name in offered), None)
        if chosen is None:
            await socket.send_denial_response(refusal_page(_NO_SUBPROTOCOL))
            return
        await socket.accept(chosen)
        await serve(socket, partial(FoxgloveConnection, foxglove_server))

    async def serve(socket: WebSocket, connect: Callable[[WebSocket], Client]) -> None:
        if len(connections) >= MAX_CONNECTIONS:
            reason = f"{MAX_CONNECTIONS} connections are open already"
            await socket.close(_TRY_AGAIN_LATER, reason)
            return
        connection = connect(socket)
        connections.add(connection)
        try:
            await connection.run()
        finally:
            connections.discard(connection)

    routes = [
        Route("/", index),
        *(Route(f"/{view}", index) for view in VIEWS),
        *(Route(f"/{view}/{{rest:path}}", index) for view in VIEWS),
        Route("/page/{path:path}", _file),
        Route("/style.css", _style),
        WebSocketRoute("/ws", page),
        WebSocketRoute("/foxglove", foxglove),
    ]
    app = Starlette(routes=routes)
    app.router.redirect_slashes = False
    return AccessCheck(app, dashboard, connections)


class AccessCheck:
    """Lets only allowed requests pass to the application, and sets the headers of all responses."""

    def __init__(self, app: Starlette, dashboard: Dashboard, connections: set[Client]) -> None:
        self._app = app
        self._access = dashboard.access
        self._connections = connections

    async def close(self, within_s: float) -> None:
        """Close all connections; those that do not read do not get to know why."""
        closing = [asyncio.create_task(item.close()) for item in self._connections]
        if closing:
            _, waiting = await asyncio.wait(closing, timeout=within_s)
            for task in waiting:
                task.cancel()

    async def __call__(self, scope: Scope, receive: AsgiReceive, send: AsgiSend) -> None:
        """Answer one request."""
        if scope["type"] not in ("http", "websocket"):
            return
        headers = Headers(scope=scope)
        request = Request(
            path=scope["path"],
            query=scope["query_string"].decode("latin-1"),
            headers=headers,
            is_websocket=scope["type"] == "websocket",
        )
        host = headers.get("host", "")
        response = self._response(request, scope)
        if response is not None:
            if response.status_code >= HTTPStatus.BAD_REQUEST:
                response.headers["Connection"] = "close"  # no place for those without the token
            await _secured(response, host)(scope, receive, send)
            return
        if scope["type"] == "websocket":
            await self._app(scope, receive, send)
            return

        async def send_secured(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], *security_headers(host)]
            await send(message)

        await self._app(scope, receive, send_secured)

    def _response(self, request: Request, scope: Scope) -> Response | None:
        """Return the response to a request that does not reach the application, or None."""
        refusal = self._access.refusal(request)
        if refusal is not None:
            return refusal_page(refusal)
        if request.is_websocket:
            return None
        if scope["method"] not in _METHODS:
            return refusal_page(Refusal(405, "only GET is possible"))
        if "token=" in request.query:
            # The address without the token, so that it is not in the history of the browser.
            location = f"/{quote(request.path.lstrip('/'))}#key={self._access.key}"
            headers = {"Location": location, "Set-Cookie": self._access.cookie}
            return Response(status_code=303, headers=headers)
        return None


async def _file(request: HttpRequest) -> Response:
    return _content(request.path_params["path"])


async def _style(_: HttpRequest) -> Response:
    return _of_page(style_sheet(), "text/css")


def _content(path: str) -> Response:
    """Return a file of the page."""
    parts = path.split("/")
    is_odd = any(part in ("", ".", "..") or part.startswith(".") for part in parts)
    found = file_of_page(path) if not is_odd and len(path) <= _MAX_PATH else None
    if found is None or not path.endswith(_SUFFIXES) or not found.is_file():
        return refusal_page(Refusal(404, f"there is no file '{path[:_MAX_PATH]}'"))
    kind = mimetypes.guess_type(path)[0] or "application/octet-stream"
    if kind == "application/javascript":
        kind = "text/javascript"
    return _of_page(found.read_bytes(), kind)


def _of_page(content: bytes, kind: str) -> Response:
    return Response(content, media_type=kind, headers={"Cache-Control": "no-cache"})


def refusal_page(refusal: Refusal) -> Response:
    """Return a page, without scripts, that says why a request is refused."""
    text = html.escape(refusal.reason)
    page = (
        '<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>ros2-composer</title>'
        f"<h1>{refusal.status}</h1><p>{text}.</p></html>\n"
    )
    return HTMLResponse(page, status_code=refusal.status)


def _secured(response: Response, host: str) -> Response:
    response.raw_headers.extend(security_headers(host))
    return response


def security_headers(host: str) -> list[tuple[bytes, bytes]]:
    """Return headers that keep the page from loading or running anything of another origin."""
    is_plain = all(letter.isalnum() or letter in ".-:[]" for letter in host)
    socket = f" ws://{host}" if host and is_plain else ""
    policy = (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:;"
        f" connect-src 'self'{socket}; font-src 'self'; worker-src 'self'; base-uri 'none';"
        " form-action 'none'; frame-ancestors 'none'"
    )
    return [
        (b"content-security-policy", policy.encode("latin-1")),
        (b"x-content-type-options", b"nosniff"),
        (b"x-frame-options", b"DENY"),
        (b"referrer-policy", b"no-referrer"),
        (b"cross-origin-opener-policy", b"same-origin"),
        (b"cross-origin-resource-policy", b"same-origin"),
    ]


@cache
def index_of(view: str) -> bytes:
    """Return the HTML of the page; ``view`` is the first part of the address.

    It names all modules, so that the browser loads them at once: by itself, it finds the imports of
    a module only when it has loaded the module.
    """
    modules = dict.fromkeys((*_closure(_MAIN), *_closure(f"views/{_SHARED.get(view, view)}.js")))
    links = "".join(f'<link rel="modulepreload" href="/page/{name}">\n' for name in modules)
    text = (PAGE / "index.html").read_text(encoding="utf-8")
    return text.replace("</head>", f"{links}</head>", 1).encode()


@cache
def style_sheet() -> bytes:
    """Return the styles of diagrams and of the page as one file."""
    from composer.graph.formats.theme import page_style

    texts = (file_of_page(name).read_text(encoding="utf-8") for name in _STYLES)
    return "\n".join((page_style(), *texts)).encode()


def file_of_page(path: str) -> Traversable:
    """Return a file by its address below ``/page``; it need not exist."""
    if path.startswith(_GRAPH_FOLDER):
        return GRAPH_FILES.joinpath(*path.removeprefix(_GRAPH_FOLDER).split("/"))
    return PAGE.joinpath(*path.split("/"))


def _closure(module: str) -> list[str]:
    """Return a module and all that it imports, by their addresses below ``/page``."""
    found = [module]
    for name in found:
        text = file_of_page(name).read_text(encoding="utf-8")
        imported = (normpath(join(dirname(name), path)) for path in _IMPORT.findall(text))
        found += [other for other in dict.fromkeys(imported) if other not in found]
    return found
