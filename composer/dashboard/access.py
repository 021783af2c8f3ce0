"""Which requests are allowed: the token, and the Host and Origin of requests.

A browser exchanges the token for a cookie and a key. Browsers send cookies to all ports of a
computer, so servers of other users may receive it: with the cookie alone, there is only the page,
which contains nothing of this user. Its scripts keep the key where only pages of the same port can
read it, and open the WebSocket with it. Both are derived from the token: a page is connected again
to the next dashboard with the same token, and both are worthless for any other.

A page of another site can send requests to this server through the browser of its visitor. It does
not know the token, the cookie is not sent with its requests (SameSite=Strict), and its requests are
refused by their Origin. A site that rebinds its own name to this address (DNS rebinding) is refused
by the Host.
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from composer.base.fast_dataclass import dataclass

_TOKEN_BYTES = 32
#: A token of a user's own must not be guessable.
MIN_TOKEN_LENGTH = 16
_MAX_TOKEN_LENGTH = 1024
_HTTP_PORT = 80
_BEARER = "bearer "
#: What browsers report for the requests of a page of this server, and for addresses that a user
#: has entered or clicked outside of pages.
_OWN_SITES = ("same-origin", "none")


class InvalidTokenFileError(Exception):
    """The file with the token cannot be read, is not private, or has no valid token."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a request is refused, and the HTTP status that says so."""

    status: int
    reason: str


@dataclass(frozen=True, slots=True)
class Request:
    """The parts of a request that decide whether it is allowed. Header names are in lower case."""

    path: str
    query: str
    headers: Mapping[str, str]
    is_websocket: bool = False

    @property
    def given_token(self) -> str | None:
        """The token in the query or in the Authorization header, which no other page knows."""
        authorization = self.headers.get("authorization", "")
        if authorization.lower().startswith(_BEARER):
            return authorization[len(_BEARER) :].strip()
        return self._in_query("token")

    @property
    def given_key(self) -> str | None:
        """The key that a page has got in exchange for the token."""
        return self._in_query("key")

    def _in_query(self, name: str) -> str | None:
        try:
            values = parse_qs(self.query, keep_blank_values=True, max_num_fields=20).get(name, [])
        except ValueError:
            return None
        return values[0] if len(values) == 1 else None


class Access:
    """Decides about requests to the server at ``host`` and ``port``."""

    def __init__(self, token: str, host: str, port: int) -> None:
        self._token = token
        self._cookie = _derived(token, f"cookie {port}")
        #: What a page needs to open the WebSocket.
        self.key = _derived(token, f"key {port}")
        self._is_loopback = is_loopback(host)
        self._port = port
        #: Cookies are shared by all ports of a computer, so the name contains the port.
        self.cookie_name = f"compose_dashboard_{port}"

    @property
    def cookie(self) -> str:
        """The Set-Cookie header for a browser that knows the token."""
        return f"{self.cookie_name}={self._cookie}; HttpOnly; SameSite=Strict; Path=/"

    def refusal(self, request: Request) -> Refusal | None:
        """Return why a request is refused, or None if it is allowed."""
        return (
            self._host_refusal(request.headers)
            or self._origin_refusal(request)
            or self._token_refusal(request)
        )

    def is_valid(self, token: str | None) -> bool:
        """Return whether this is the token, in a time that does not depend on the token."""
        return _is_same(token, self._token)

    def _host_refusal(self, headers: Mapping[str, str]) -> Refusal | None:
        host = headers.get("host", "")
        if not self._is_own(host):
            return Refusal(421, f"this server is not '{host:.80}': use the address that it printed")
        return None

    def _origin_refusal(self, request: Request) -> Refusal | None:
        origin = request.headers.get("origin")
        if origin is not None:
            # A page of this server has its address; programs may send none, but then the token.
            scheme, separator, host = origin.partition("://")
            is_own = bool(separator) and scheme == "http" and host == request.headers.get("host")
            if not is_own and not self.is_valid(request.given_token):
                return Refusal(403, f"requests of pages of '{origin:.80}' are not allowed")
        elif request.is_websocket and not self.is_valid(request.given_token):
            return Refusal(403, "a WebSocket request needs an Origin, or the token in its address")
        site = request.headers.get("sec-fetch-site", "none")
        is_navigation = request.headers.get("sec-fetch-mode") == "navigate"
        if site not in _OWN_SITES and not is_navigation and origin is None:
            return Refusal(403, "requests of pages of other sites are not allowed")
        return None

    def _token_refusal(self, request: Request) -> Refusal | None:
        if self.is_valid(request.given_token):
            return None
        if request.given_token is not None:
            return Refusal(401, "the token is not valid: it changes with each start")
        key = request.given_key
        needs_key = request.is_websocket or key is not None
        has_key = not needs_key or _is_same(key, self.key)
        if has_key and _is_same(self._given_cookie(request.headers), self._cookie):
            return None
        return Refusal(401, "open the address with the token that 'compose dashboard' printed")

    def _given_cookie(self, headers: Mapping[str, str]) -> str | None:
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(self.cookie_name)
        except CookieError:
            return None
        return None if cookie is None else cookie.value

    def _is_own(self, host: str) -> bool:
        """Return whether a Host header names this server.

        An address is never rebound; a name must be a name of this computer.
        """
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port
        except ValueError:
            return False
        if "@" in host or (port or _HTTP_PORT) != self._port or parts.path or not name:
            return False
        if is_loopback(name):
            return True
        return not self._is_loopback and (_is_address(name) or name in _own_names())


def _derived(token: str, purpose: str) -> str:
    return hmac.new(token.encode(), purpose.encode(), "sha256").hexdigest()


def _is_same(given: str | None, secret: str) -> bool:
    content = (given or "").encode("utf-8", "surrogatepass")
    return secrets.compare_digest(content, secret.encode())


def new_token() -> str:
    """Return a random token, which fits into an address."""
    return secrets.token_urlsafe(_TOKEN_BYTES)


def read_token(path: Path) -> str:
    """Return the token in a file. Raises InvalidTokenFileError."""
    try:
        if path.stat().st_mode & 0o077:
            raise InvalidTokenFileError(f"'{path}' can be read by other users: chmod 600 '{path}'")
        with path.open(encoding="ascii") as file:
            token = file.read(_MAX_TOKEN_LENGTH + 1).strip()
    except (OSError, UnicodeDecodeError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not ASCII text"
        raise InvalidTokenFileError(f"cannot read the token in '{path}': {reason}") from error
    if not MIN_TOKEN_LENGTH <= len(token) <= _MAX_TOKEN_LENGTH or not _fits_address(token):
        raise InvalidTokenFileError(
            f"the token in '{path}' must have {MIN_TOKEN_LENGTH} to {_MAX_TOKEN_LENGTH} letters,"
            " digits, '-' and '_'"
        )
    return token


def is_loopback(host: str) -> bool:
    """Return whether a host name or address can only be reached from this computer."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _fits_address(token: str) -> bool:
    return all(letter.isalnum() or letter in "-_" for letter in token)


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _own_names() -> tuple[str, ...]:
    name = socket.gethostname().lower()
    return (name, f"{name}.local", name.partition(".")[0])
