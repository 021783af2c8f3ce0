"""A name, an address, a user, a file or a ROS domain of a host that cannot be used."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error
from composer.model import Host
from composer.model.hosts import (
    address_problem,
    domain_problem,
    key_file_problem,
    name_problem,
    user_problem,
    workspace_problem,
)
from composer.source import Located

RULE = error(
    code="RC492",
    name="invalid-host",
    summary="A host has an invalid name, address, user, file, workspace or ROS domain.",
    why=(
        "'compose sync' copies the project to the workspace and may delete other files there, "
        "so it must be a folder of its own. Names of hosts become files and settings of "
        "'compose export'; addresses, users and files are words of command lines."
    ),
    bad="""\
system: robot
hosts: {jetson: {user: robot, workspace: /home}}
processes: {vision: {nodes: [camera], host: jetson}}
nodes:
  camera: {on_activate: {log: started}}
""",
    good="""\
system: robot
hosts: {jetson: {user: robot, workspace: /home/robot/vision}}
processes: {vision: {nodes: [camera], host: jetson}}
nodes:
  camera: {on_activate: {log: started}}
""",
)
_WORKSPACE_HINT = "name a folder that only holds this project, such as ~/robot"


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the hosts."""
    for host in context.system.hosts:
        yield from _check_host(host)


def _check_host(host: Host) -> Iterator[Diagnostic]:
    problem = None if is_unresolved(host.name.value) else name_problem(host.name.value)
    if problem is not None:
        yield Diagnostic(RULE, f"the name of host '{host.name}' {problem}", host.name.span)
    address = None if host.address == host.name else host.address  # reported once
    checks: tuple[tuple[str, Located[str] | None, Callable[[str], str | None], str | None], ...] = (
        ("address", address, address_problem, None),
        ("user", host.user, user_problem, None),
        ("identity_file", _located(host, host.identity_file), key_file_problem, None),
        ("known_hosts", _located(host, host.known_hosts), key_file_problem, None),
        ("workspace", host.workspace, workspace_problem, _WORKSPACE_HINT),
    )
    for what, written, find_problem, hint in checks:
        if written is None or is_unresolved(written.value):
            continue
        problem = find_problem(written.value)
        if problem is not None:
            text = f"the {what} of host '{host.name}', '{written}', {problem}"
            yield Diagnostic(RULE, text, written.span, hint=hint)
    for name, value in host.environment:
        problem = domain_problem(value) if name.value == "ROS_DOMAIN_ID" else None
        if problem is not None and not is_unresolved(value):
            text = f"the ROS_DOMAIN_ID of host '{host.name}', '{value}', {problem}"
            yield Diagnostic(RULE, text, name.span)


def _located(host: Host, text: str | None) -> Located[str] | None:
    return None if text is None else Located(text, host.span)
