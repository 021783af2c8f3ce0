"""ssh connections to hosts: with keys and known hosts only, and errors that say what to do."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, TypeAlias

import asyncssh

from composer.base.characters import escape_line
from composer.client.hosts.remote_command import NO_PYTHON, NO_SETUP, NO_WORKSPACE, workspace
from composer.model import Host
from composer.model.hosts import key_file

_CONNECT_WITHIN_S = 10.0
_READ = 65_536
#: A connection over which nothing is received for their product is lost; see ``SILENCE_S``.
_KEEPALIVE_S, _KEEPALIVE_COUNT = 5.0, 6
#: A command of a host ends after this time without a word from here.
SILENCE_S = _KEEPALIVE_S * _KEEPALIVE_COUNT
_NOT_FOUND = 127
_INSTALL = "install this version of ros2-composer there, or set 'python' of the host"


#: What a host may send back as the output of a command, in characters, and what is shown of it.
MOST_OUTPUT = 4_000_000
_LONGEST_REASON = 500


#: Why a host cannot be used, and what to do.
Problem: TypeAlias = tuple[str, str | None]


class HostsError(Exception):
    """Hosts cannot be used: a message and a hint each."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__("\n".join(text for text, _ in problems))
        self.problems = tuple(problems)


class HostError(HostsError):
    """A host cannot be used; the text says why, and the hint what to do.

    The text is one line, though a host has sent parts of it.
    """

    def __init__(self, host: Host, reason: str, hint: str | None = None) -> None:
        super().__init__([(f"{host.name} ({host.login}): {shown(reason)}", hint)])


class Output(NamedTuple):
    """What a command has written, and its exit code, if it has one."""

    status: int | None
    text: str
    errors: str


def shown(text: str) -> str:
    """Return the beginning of what a host has sent, as a part of one line."""
    return escape_line(text if len(text) <= _LONGEST_REASON else f"{text[:_LONGEST_REASON]} ...")


async def connect(host: Host, root: Path) -> asyncssh.SSHClientConnection:
    """Log in. ``root`` is where relative paths of key files begin. Raises HostError.

    Settings in ``~/.ssh/config`` apply, but passwords are never asked for, agents never forwarded
    and unknown host keys never accepted.
    """
    port = "" if host.port is None else f" -p {host.port}"
    try:
        options = _options(host, root)
        return await asyncssh.connect(host.address.value, options=options)
    except asyncssh.HostKeyNotVerifiable as error:
        known = f" -o UserKnownHostsFile={host.known_hosts}" if host.known_hosts else ""
        raise HostError(
            host,
            "its host key is unknown, or has changed",
            f"log in once, and compare the fingerprint: ssh{port}{known} {host.login}",
        ) from error
    except asyncssh.PermissionDenied as error:
        raise HostError(
            host,
            "it accepts none of the keys",
            f"permit one: ssh-copy-id{port} {host.login}; or set 'identity_file'",
        ) from error
    except asyncssh.Error as error:
        raise HostError(host, f"cannot log in: {error.reason or type(error).__name__}") from error
    except TimeoutError as error:
        raise HostError(
            host, f"cannot connect: no response within {_CONNECT_WITHIN_S:g} s"
        ) from error
    except OSError as error:
        raise HostError(host, f"cannot connect: {_reason(error)}") from error
    except ValueError as error:  # of a file that asyncssh reads
        reason = f"cannot read the configuration, keys or known hosts of ssh: {error}"
        raise HostError(host, reason, "check the files in ~/.ssh") from error


async def run_command(
    host: Host,
    connection: asyncssh.SSHClientConnection,
    command: str,
    *,
    stdin: str = "",
    within_s: float,
) -> Output:
    """Run a command there.

    Raises HostError if it takes longer or writes too much, or if the connection is lost.
    """

    async def read(stream: asyncssh.SSHReader[str]) -> str:
        parts, size = list[str](), 0
        while part := await stream.read(_READ):
            parts.append(part)
            size += len(part)
            if size > MOST_OUTPUT:
                raise HostError(host, f"it sends more than {MOST_OUTPUT // 10**6} MB as an answer")
        return "".join(parts)

    try:
        async with asyncio.timeout(within_s):
            process = await connection.create_process(command, errors="replace")
            try:
                with suppress(BrokenPipeError):  # it has ended already; its exit code says why
                    process.stdin.write(stdin)
                    process.stdin.write_eof()
                text, errors = await asyncio.gather(read(process.stdout), read(process.stderr))
                await process.wait_closed()
            finally:
                process.close()
    except TimeoutError as error:
        raise HostError(host, f"it has not answered within {within_s:g} s") from error
    except (asyncssh.Error, OSError) as error:
        raise HostError(host, f"connection lost: {error}") from error
    return Output(process.exit_status, text, errors)


def _options(host: Host, root: Path) -> asyncssh.SSHClientConnectionOptions:
    """Return the options of a connection. Raises ValueError, OSError."""
    return asyncssh.SSHClientConnectionOptions(
        port=() if host.port is None else host.port,
        username=() if host.user is None else host.user.value,
        client_keys=() if host.identity_file is None else [str(key_file(host.identity_file, root))],
        known_hosts=() if host.known_hosts is None else str(key_file(host.known_hosts, root)),
        public_key_auth=True,
        password_auth=False,
        kbdint_auth=False,
        host_based_auth=False,
        gss_auth=False,
        gss_kex=False,
        agent_forwarding=False,
        x11_forwarding=False,
        connect_timeout=_CONNECT_WITHIN_S,
        login_timeout=_CONNECT_WITHIN_S,
        keepalive_interval=_KEEPALIVE_S,
        keepalive_count_max=_KEEPALIVE_COUNT,
        host=host.address.value,
    )


def load_keys(host: Host, root: Path) -> None:
    """Check the files of a host that ssh needs. Raises HostError."""
    for what, name in (("identity_file", host.identity_file), ("known_hosts", host.known_hosts)):
        if name is not None and not key_file(name, root).is_file():
            raise HostError(host, f"there is no file '{name}'", f"correct '{what}' of the host")
    if host.identity_file is None:
        return
    path = key_file(host.identity_file, root)
    try:
        asyncssh.read_private_key(path)
    except ValueError as error:
        text = str(error).lower()
        if "passphrase" in text:
            raise HostError(
                host,
                f"the key '{host.identity_file}' has a passphrase",
                f"load it: ssh-add {host.identity_file}; and remove 'identity_file'",
            ) from error
        raise HostError(host, f"'{host.identity_file}' is not a private key") from error
    except OSError as error:
        raise HostError(host, f"cannot read '{host.identity_file}': {error.strerror}") from error


def failure_of(host: Host, status: int | None, output: str) -> HostError:
    """Return the error for a command that has not worked; ``output`` is what it wrote."""
    folder = workspace(host)
    tried = f"'{host.python or f'{folder}/.venv/bin/python'}'"
    tried += "" if host.python else " or 'python3'"
    known = {
        NO_WORKSPACE: HostError(
            host, f"there is no workspace '{folder}'", "copy the project with 'compose hosts sync'"
        ),
        NO_SETUP: HostError(host, f"a script of 'setup' is not there: {', '.join(host.setup)}"),
        NO_PYTHON: HostError(host, f"there is no Python {tried}", _INSTALL),
        _NOT_FOUND: HostError(host, _last(output)),
    }
    if status in known:
        return known[status]
    if "No module named" in output and "composer" in output:
        return HostError(host, f"the Python there, {tried}, has no ros2-composer", _INSTALL)
    return HostError(host, _last(output) or f"the command failed with exit code {status}")


def _last(output: str) -> str:
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    return lines[-1] if lines else ""


def _reason(error: OSError) -> str:
    """Return what went wrong, in the words of the operating system or of name resolution."""
    if error.errno is not None and error.errno > 0:
        return os.strerror(error.errno)
    return error.strerror or str(error)
