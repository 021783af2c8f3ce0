"""What the commands for hosts share: the hosts of a system, and errors about them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import typer

from composer.cli.support.errors import CONFIG, FAILED, CommandError, require_extra
from composer.cli.support.system_arguments import LoadOptions, runnable_system
from composer.cli.support.terminal import lines, say, write

if TYPE_CHECKING:
    from composer.client.hosts.deployment import RemoteProcess
    from composer.loading.reported import LoadResult
    from composer.model import Host, LogLevel, System
    from composer.project.copied_files import CopiedFiles


def require_hosts(command: str, *programs: str) -> None:
    """Raise CommandError if the package of the extra ``hosts``, or a program, is not installed."""
    require_extra(command, "hosts", "asyncssh")
    for program in programs:
        if shutil.which(program) is None:
            raise CommandError(f"'{command}' needs {program}, which is not installed")


def files_to_copy(system: System, root: Path) -> CopiedFiles:
    """Return which files of the project are copied, to hosts and into images.

    Raises CommandError if the project is a whole home folder or file system.
    """
    from composer.model.hosts import key_file
    from composer.project.copied_files import copied_files

    home = os.path.realpath(os.path.expanduser("~"))  # noqa: PTH111 - there may be none
    if root in (Path(home), Path(root.anchor)):
        raise CommandError(
            f"the root of the project is '{root}', which is not copied as a whole",
            hint="an empty composer.yaml marks the root of a project",
        )
    names = [host.identity_file for host in system.hosts if host.identity_file is not None]
    return copied_files(root, [key_file(name, root) for name in names])


def write_staying(files: CopiedFiles) -> None:
    """List the files of the project that are not copied, with the reasons."""
    write(lines(f"not copied: {text}" for text in files.reasons))


def load_for_hosts(
    text: str, arguments: Sequence[str] | None = (), **options: Unpack[LoadOptions]
) -> tuple[LoadResult, System, Path]:
    """Return a system without errors, and its file relative to the project. Raises CommandError."""
    system, path, result = runnable_system(text, arguments, exit_code=CONFIG, **options)
    if not system.hosts:
        raise CommandError(
            f"system '{system.name}' has no 'hosts'", hint="see docs/guides/several-computers.md"
        )
    absolute = path.resolve()
    if not absolute.is_relative_to(result.project.root):
        raise CommandError(f"'{text}' is not in the project '{result.project.root}'")
    return result, system, absolute.relative_to(result.project.root)


def check_workspaces(hosts: list[Host]) -> None:
    """Raise CommandError if a host has no workspace."""
    for host in hosts:
        if host.workspace is None:
            raise CommandError(
                f"{host.span}: host '{host.name}' has no workspace",
                hint="set 'workspace' to the folder of the project there, such as ~/robot",
            )


@contextmanager
def reported_problems() -> Iterator[None]:
    """Print what is wrong with hosts, and end the command."""
    from composer.client.hosts.connection import HostsError

    try:
        yield
    except HostsError as error:
        for text, hint in error.problems:
            say(CommandError(text, hint=hint).text())
        raise typer.Exit(FAILED) from error


@contextmanager
def process_logs(
    system: System, processes: Sequence[RemoteProcess]
) -> Iterator[Callable[[RemoteProcess, LogLevel, str, str], None]]:
    """Keep the lines of processes on other computers in log files here, for 'compose logs'."""
    from composer.cli.support.progress import RunLog
    from composer.model.names import join
    from composer.runtime.supervision.events import Logged

    with ExitStack() as stack:
        names = [item.process.name.value for item in processes]
        whole = join(system.namespace, system.name.value)
        logs = {name: RunLog(f"{whole}/{name}", part=True) for name in names}
        for each in logs.values():
            stack.callback(each.close)

        def log(item: RemoteProcess, level: LogLevel, logger: str, message: str) -> None:
            logs[item.process.name.value].show(Logged(0.0, logger, level, message))

        yield log
