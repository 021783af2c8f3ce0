"""Copy the project to the workspaces of hosts, with rsync over ssh."""

from __future__ import annotations

import os
import shlex
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import asyncssh

from composer.base.fast_dataclass import dataclass
from composer.client.hosts.connection import MOST_OUTPUT, HostError, run_command
from composer.client.hosts.remote_command import quoted_path, workspace
from composer.model import Host
from composer.model.hosts import key_file
from composer.project.copied_files import MARK

_NOT_OURS, _NOT_WRITABLE, _NOT_FOUND = 74, 75, 127
#: How often to look how much a host has written.
_LOOK_S = 0.5
_FOLDER = "compose-workspace:"
_PREPARED_WITHIN_S = 60.0
_COPY_WITHIN_S = 3600.0


@dataclass(frozen=True, slots=True)
class SyncOptions:
    """What to copy: everything below ``root`` that ``excluded`` patterns of rsync do not match.

    With ``delete``, files of the workspace that are not in the project are deleted. With
    ``dry_run``, nothing is changed.
    """

    root: Path
    delete: bool = False
    dry_run: bool = False
    excluded: tuple[str, ...] = ()


async def prepare_workspace(
    host: Host, connection: asyncssh.SSHClientConnection, *, dry_run: bool
) -> str:
    """Make the workspace, or check that it holds a copy of a project; return its absolute path.

    Raises HostError.
    """
    folder = quoted_path(workspace(host))
    lines = [f"printf '\\n{_FOLDER}%s\\n' {folder}"]
    lines.append(f"[ -d {folder} ] || exit 0" if dry_run else f"mkdir -p {folder}")
    lines += [f"cd {folder}", f'[ -e {MARK} ] || [ -z "$(ls -A)" ] || exit {_NOT_OURS}']
    lines += [] if dry_run else [f"touch {MARK}"]
    script = " && ".join(f"{{ {line}; }}" for line in lines) + f" || exit {_NOT_WRITABLE}"
    command = f"exec sh -c {shlex.quote(script)}"
    done = await run_command(host, connection, command, within_s=_PREPARED_WITHIN_S)
    name = workspace(host)
    if done.status == _NOT_OURS:
        raise HostError(
            host,
            f"the workspace '{name}' holds other files, which were not copied by"
            " 'compose hosts sync'",
            f"choose another folder; or permit it: ssh {host.login} touch {name}/{MARK}",
        )
    path = folder_in(done.text)
    if done.status != 0 or path is None:
        lines = (done.text + done.errors).splitlines()
        raise HostError(host, f"cannot write to '{name}': {lines[-1] if lines else 'no reason'}")
    return path


def folder_in(output: str) -> str | None:
    """Return the absolute path of the workspace in the output of the command that prepares it.

    Other lines come from start-up files of the shell.
    """
    found = [line for line in output.splitlines() if line.startswith(f"{_FOLDER}/")]
    return found[-1].removeprefix(_FOLDER) if found else None


def copy_project(host: Host, target: str, options: SyncOptions) -> tuple[str, ...]:
    """Copy the project to the folder ``target``; return what was copied or deleted.

    Raises HostError.
    """
    command = rsync_command(host, target, options)
    with TemporaryFile() as written, TemporaryFile() as problems:
        process = subprocess.Popen(  # noqa: S603 - the words are checked by the rule invalid-host
            command, stdin=subprocess.PIPE, stdout=written, stderr=problems
        )
        excluded = "".join(f"{pattern}\0" for pattern in options.excluded).encode()
        _wait_for_copy(host, process, excluded, problems)
        problems.seek(0)
        text = problems.read(MOST_OUTPUT).decode(errors="replace")
        if process.returncode != 0:
            lines = [line for line in text.splitlines() if line.strip()]
            reason = lines[0] if lines else f"exit code {process.returncode}"
            is_missing = "command not found" in text or process.returncode == _NOT_FOUND
            hint = "install rsync there" if is_missing else None
            raise HostError(host, f"rsync failed: {reason}", hint)
        written.seek(0)
        copied = written.read().decode(errors="replace").splitlines()
    return tuple(line for line in copied if not line.endswith("/"))


def _wait_for_copy(
    host: Host, process: subprocess.Popen[bytes], excluded: bytes, problems: IO[bytes]
) -> None:
    """Wait for rsync. Raises HostError if it takes too long, or the host writes too much."""
    end_s = time.monotonic() + _COPY_WITHIN_S
    given: bytes | None = excluded
    while True:
        with suppress(subprocess.TimeoutExpired):
            process.communicate(given, timeout=_LOOK_S)
            return
        given = None  # what is left of it is written by the next call
        is_late = time.monotonic() > end_s
        if is_late or os.fstat(problems.fileno()).st_size > MOST_OUTPUT:
            process.kill()
            process.wait()
            reason = f"has not ended within {_COPY_WITHIN_S:g} s"
            if not is_late:
                reason = (
                    f"was ended: the host sends more than {MOST_OUTPUT // 10**6} MB of messages"
                )
            raise HostError(host, f"rsync {reason}")


def rsync_command(host: Host, target: str, options: SyncOptions) -> list[str]:
    """Return the command that copies the project to the folder ``target`` of a host."""
    ssh = ["ssh", "-a", "-x", *([] if host.port is None else ["-p", str(host.port)])]
    settings = {"BatchMode": "yes", "StrictHostKeyChecking": "yes", "PasswordAuthentication": "no"}
    files = {"IdentityFile": host.identity_file, "UserKnownHostsFile": host.known_hosts}
    settings |= {
        name: str(key_file(file, options.root)).replace("%", "%%")  # ssh replaces %h and others
        for name, file in files.items()
        if file is not None
    }
    for name, value in settings.items():
        quoted = f'"{value}"' if " " in value or "'" in value else value
        ssh += ["-o", f"{name}={quoted}"]
    address = f"[{host.address}]" if ":" in host.address.value else host.address.value
    user = "" if host.user is None else f"{host.user}@"
    return [
        "rsync",
        "--recursive",
        "--links",
        "--perms",
        "--times",
        "--checksum",
        "--secluded-args",  # no shell there reads the names
        "--out-format=%o %n",
        *(["--delete"] if options.delete else []),
        *(["--dry-run"] if options.dry_run else []),
        "--from0",
        "--exclude-from=-",
        f"--rsh={shlex.join(ssh)}",
        "--",
        f"{options.root}{os.sep}",
        f"{user}{address}:{target}/",
    ]
