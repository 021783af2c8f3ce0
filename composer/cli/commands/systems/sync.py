"""``compose sync``: copy the project to the hosts of a system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.support.errors import CommandError, UsageError
from composer.cli.support.hosts import (
    check_workspaces,
    files_to_copy,
    load_for_hosts,
    reported_problems,
    require_hosts,
    write_staying,
)
from composer.cli.support.options import examples
from composer.cli.support.output.terminal import lines, write
from composer.cli.support.system_arguments import SystemName

if TYPE_CHECKING:
    from composer.model import Host

EPILOGS = {
    "sync": examples(
        "compose sync systems/robot.yaml",
        "compose sync robot --dry-run               list what would be copied",
        "compose sync robot --host jetson --delete  remove files that are not in the project",
    )
}


def sync(
    system: SystemName,
    *,
    names: Annotated[
        list[str] | None,
        typer.Option(
            "--host",
            metavar="NAME",
            help="Only to this host. Repeatable.",
            show_default="all hosts of the system",
        ),
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="List the files that would be copied, deleted or left."),
    ] = False,
    delete: Annotated[
        bool,
        typer.Option(
            "--delete", help="Delete files in the workspaces that are not in the project."
        ),
    ] = False,
) -> None:
    """Copy the project to the hosts of a system.

    Copies the folder of the project to the workspace of each host, with rsync over ssh, except for
    environments, builds, logs, .git, private keys, .env files, and what .gitignore or .dockerignore
    exclude. Nothing outside the workspaces is changed. A folder with files that this command has
    not copied is refused.
    """
    require_hosts("compose sync", "rsync", "ssh")
    result, declared, _ = load_for_hosts(system)
    from composer.client.hosts.start import sync_hosts
    from composer.client.hosts.sync import SyncOptions, root_problem
    from composer.runtime.process.addresses import is_this_computer

    root = result.project.root
    problem = root_problem(root)
    if problem is not None:
        raise CommandError(problem, hint="an empty composer.yaml marks the root of a project")
    others = [host for host in declared.hosts if not is_this_computer(host.address.value)]
    chosen = _chosen(others, names or [], declared.name.value)
    check_workspaces(chosen)
    files = files_to_copy(declared, root)
    if dry_run:
        write_staying(files)
    with reported_problems():
        sync_hosts(
            chosen,
            SyncOptions(root, delete, dry_run, files.rsync_patterns),
            lambda host, changes: _report(host, changes, dry_run=dry_run),
        )


def _chosen(hosts: list[Host], names: list[str], system: str) -> list[Host]:
    from composer.base.diagnostics import suggestion

    by_name = {host.name.value: host for host in hosts}
    for name in names:
        if name not in by_name:
            hint = suggestion(name, list(by_name))
            raise UsageError(f"'{name}' is not another host of system '{system}'", hint=hint)
    if not hosts:
        raise CommandError(f"all hosts of system '{system}' are this computer")
    return [by_name[name] for name in dict.fromkeys(names)] if names else hosts


def _report(host: Host, changes: Sequence[str], *, dry_run: bool) -> None:
    if dry_run:
        words = {"send": "copy", "del.": "delete"}
        for change in changes:
            what, _, name = change.partition(" ")
            write(lines([f"{host.name}: {words.get(what, what)} {name}"]))
    deleted = sum(change.startswith("del.") for change in changes)
    copied = len(changes) - deleted
    verb = "would be " if dry_run else ""
    parts = [f"{_files(copied)} {verb}copied"] if copied else []
    parts += [f"{_files(deleted)} {verb}deleted"] if deleted else []
    write(lines([f"{host.name}: {', '.join(parts) or 'up to date'}"]))


def _files(count: int) -> str:
    return "1 file" if count == 1 else f"{count} files"
