"""Which requests to the dashboard are allowed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from composer.dashboard.access import Access, InvalidTokenFileError, Request, new_token, read_token

TOKEN = "correct-horse-battery-staple"
OWN = "127.0.0.1:8800"
LOCAL = Access(TOKEN, "127.0.0.1", 8800)
PUBLIC = Access(TOKEN, "0.0.0.0", 8800)
OTHER = Access(TOKEN, "127.0.0.1", 8801)
COOKIE = LOCAL.cookie.partition(";")[0]


def status(access: Access = LOCAL, *, query: str = "", ws: bool = False, **headers: str) -> int:
    """Return the status of a request; a header given as empty text is not sent."""
    given = {"host": OWN, "cookie": access.cookie.partition(";")[0], **headers}
    if ws and not query:
        query = f"key={access.key}"
    named = {name.replace("_", "-"): value for name, value in given.items() if value}
    refusal = access.refusal(Request("/", query, named, is_websocket=ws))
    return 200 if refusal is None else refusal.status


@pytest.mark.parametrize(
    ("headers", "expected"),
    [
        ({}, 200),
        ({"cookie": ""}, 401),
        ({"cookie": "compose_dashboard_8800=wrong"}, 401),
        ({"cookie": COOKIE.replace("8800", "8801")}, 401),  # of the dashboard at another port
        ({"cookie": f"compose_dashboard_8800={TOKEN}"}, 401),
        ({"cookie": f"other=1; {COOKIE}; last=2"}, 200),
        ({"cookie": "\x00;;;=;"}, 401),
        ({"cookie": "", "authorization": f"Bearer {TOKEN}"}, 200),
        ({"cookie": "", "authorization": f"Basic {TOKEN}"}, 401),
        ({"authorization": "Bearer wrong"}, 401),  # a wrong token is never ignored
        ({"cookie": "", "authorization": "Bearer \udcff\xe9"}, 401),
        # in the address
        ({"cookie": "", "query": f"token={TOKEN}"}, 200),
        ({"cookie": "", "query": f"a=1&token={TOKEN}"}, 200),
        ({"cookie": "", "query": "token=wrong"}, 401),
        ({"cookie": "", "query": f"token={TOKEN}&token={TOKEN}"}, 401),
        ({"cookie": "", "query": f"token={TOKEN}x"}, 401),
        ({"cookie": "", "query": "&".join(f"a{n}=1" for n in range(50))}, 401),
    ],
)
def test_the_token_is_needed(headers: dict[str, Any], expected: int) -> None:
    assert status(**headers) == expected


@pytest.mark.parametrize(
    ("host", "local", "public"),
    [
        (OWN, 200, 200),
        ("localhost:8800", 200, 200),
        ("[::1]:8800", 200, 200),
        ("127.0.0.1", 421, 421),
        ("127.0.0.1:8801", 421, 421),
        ("attacker.example:8800", 421, 421),  # DNS rebinding
        ("127.0.0.1.attacker.example:8800", 421, 421),
        ("attacker.example@127.0.0.1:8800", 421, 421),
        ("127.0.0.1:8800/x", 421, 421),
        ("127.0.0.1:99999999", 421, 421),
        ("[::1:8800", 421, 421),
        ("", 421, 421),
        ("192.168.1.5:8800", 421, 200),
        (f"{os.uname().nodename}:8800".lower(), 421, 200),
    ],
)
def test_the_host_must_be_this_server(host: str, local: int, public: int) -> None:
    assert (status(host=host), status(PUBLIC, host=host)) == (local, public)


@pytest.mark.parametrize(
    ("headers", "page", "socket"),
    [
        ({}, 200, 403),  # browsers always send the origin of a WebSocket request
        ({"origin": f"http://{OWN}"}, 200, 200),
        ({"origin": f"https://{OWN}"}, 403, 403),
        ({"origin": "http://attacker.example"}, 403, 403),
        ({"origin": "http://127.0.0.1:3000"}, 403, 403),  # another server on this computer
        ({"origin": "http://localhost:8800"}, 403, 403),  # not the host of the request
        ({"origin": "null"}, 403, 403),
        ({"origin": "http://"}, 403, 403),
        ({"sec_fetch_site": "same-origin"}, 200, 403),
        ({"sec_fetch_site": "cross-site"}, 403, 403),
        ({"sec_fetch_site": "same-site"}, 403, 403),
        ({"sec_fetch_site": "cross-site", "sec_fetch_mode": "navigate"}, 200, 403),
    ],
)
def test_pages_of_other_origins_are_refused(
    headers: dict[str, str], page: int, socket: int
) -> None:
    assert (status(**headers), status(ws=True, **headers)) == (page, socket)


def test_a_program_that_knows_the_token_needs_no_origin() -> None:
    assert status(ws=True, cookie="", query=f"token={TOKEN}") == 200
    assert status(ws=True, cookie="", query=f"token={TOKEN}", origin="https://app.example") == 200
    assert status(ws=True, cookie="", query="token=wrong", origin="https://app.example") == 403


def test_the_cookie_alone_opens_no_websocket() -> None:
    """Browsers send it to the servers of other users on this computer as well.

    They do not send it for other sites, and no script reads it.
    """
    assert LOCAL.cookie.endswith("; HttpOnly; SameSite=Strict; Path=/")
    assert TOKEN not in LOCAL.cookie
    for query in ("key=", "key=wrong", f"key={OTHER.key}", f"key={LOCAL.key}&key={LOCAL.key}"):
        assert status(ws=True, query=query, origin=f"http://{OWN}") == 401
    assert status(query="key=wrong") == 401  # how the page learns that its key is old
    assert status(ws=True, cookie="", origin=f"http://{OWN}") == 401
    assert status(ws=True, origin=f"http://{OWN}") == 200


def test_tokens_are_random_and_long() -> None:
    assert len({new_token() for _ in range(100)}) == 100
    assert len(new_token()) >= 43


@pytest.mark.parametrize(
    ("content", "mode", "reason"),
    [
        (TOKEN, 0o644, "can be read by other users"),
        ("short", 0o600, "16 to 1024 letters"),
        ("", 0o600, "16 to 1024 letters"),
        ("a b c d e f g h i j k l", 0o600, "16 to 1024 letters"),
        ("x" * 5000, 0o600, "16 to 1024 letters"),
        ("käsekuchenkäsekuchen", 0o600, "not ASCII"),
    ],
)
def test_a_token_file_that_is_not_safe(
    content: str, mode: int, reason: str, tmp_path: Path
) -> None:
    path = tmp_path / "token"
    with pytest.raises(InvalidTokenFileError, match="No such file"):
        read_token(path)
    path.write_text(content)
    path.chmod(mode)
    with pytest.raises(InvalidTokenFileError, match=reason):
        read_token(path)
    path.chmod(0o600)
    path.write_text(f"{TOKEN}\n")
    assert read_token(path) == TOKEN
