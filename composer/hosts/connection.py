"""ssh connections to hosts: with keys and known hosts only, and errors that say what to do."""

from __future__ import annotations

import os
from pathlib import Path

import asyncssh

from composer.hosts.remote_command import NO_PYTHON, NO_SETUP, NO_WORKSPACE, workspace
from composer.model import Host
from composer.model.hosts import key_file

_CONNECT_WITHIN_S = 10.0
#: A connection over which nothing is received for their product is lost; see ``SILENCE_S``.
_KEEPALIVE_S, _KEEPALIVE_COUNT = 5.0, 6
#: A command of a host ends after this time without a word from here.
SILENCE_S = _KEEPALIVE_S * _KEEPALIVE_COUNT
_NOT_FOUND = 127
_INSTALL = "install this version of ros2-composer there, or set 'python' of the host"


class HostError(Exception):
    """A host cannot be used; the text says why, and ``hint`` what to do."""

    def __init__(self, host: Host, reason: str, hint: str | None = None) -> None:
        super().__init__(f"{host.name} ({host.login}): {reason}")
        self.hint = hint


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
            "its host key is unknown, or not the one that is known",
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
            host, f"there is no workspace '{folder}'", "copy the project with 'compose sync'"
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
