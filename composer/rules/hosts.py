"""The computers that processes run on, and environment variables."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from composer.base.diagnostics import Diagnostic, error, suggestion
from composer.base.source import Located
from composer.language.rules import UNUSED_DECLARATION
from composer.model import Host
from composer.model.hosts import (
    address_problem,
    domain_problem,
    key_file_problem,
    name_problem,
    user_problem,
    workspace_problem,
)
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.references import UNDECLARED_NAME, absence

INVALID_HOST = error("RC492", "invalid-host")
ENVIRONMENT_VARIABLE = error("RC494", "environment-variable")


def check_unknown_host(context: Context) -> Iterator[Diagnostic]:
    """Check the hosts of processes."""
    system = context.system
    if context.is_partial:
        return
    hosts = [host.name.value for host in system.hosts]
    for process in system.processes:
        name = process.host
        if name is None or name.value in hosts or is_unresolved(name.value):
            continue
        why = absence(system, "hosts", name.value, "a host")
        yield Diagnostic(
            UNDECLARED_NAME,
            f"process '{process.name}' runs on '{name}', {why.text}",
            name.span,
            why.labels,
            why.hint or suggestion(name.value, hosts) or "declare it under 'hosts:'",
        )


def check_unused_host(context: Context) -> Iterator[Diagnostic]:
    """Check that each host has a process; a misspelled one is reported where it is named."""
    system = context.system
    named = [process.host for process in system.processes if process.host is not None]
    used = {name.value for name in named}
    known = {host.name.value for host in system.hosts}
    if context.is_partial or used - known or any(map(is_unresolved, used)):
        return
    for host in system.hosts:
        if host.name.value not in used:
            yield Diagnostic(
                UNUSED_DECLARATION,
                f"host '{host.name}' has no process",
                host.name.span,
                hint=f"set 'host: {host.name}' of a process",
            )


_WORKSPACE_HINT = "name a folder that only holds this project, such as ~/robot"


def check_invalid_host(context: Context) -> Iterator[Diagnostic]:
    """Check the hosts."""
    for host in context.system.hosts:
        yield from _check_host(host)


def _check_host(host: Host) -> Iterator[Diagnostic]:
    problem = None if is_unresolved(host.name.value) else name_problem(host.name.value)
    if problem is not None:
        yield Diagnostic(INVALID_HOST, f"the name of host '{host.name}' {problem}", host.name.span)
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
            yield Diagnostic(INVALID_HOST, text, written.span, hint=hint)
    for name, value in host.environment:
        problem = domain_problem(value) if name.value == "ROS_DOMAIN_ID" else None
        if problem is not None and not is_unresolved(value):
            text = f"the ROS_DOMAIN_ID of host '{host.name}', '{value}', {problem}"
            yield Diagnostic(INVALID_HOST, text, name.span)


def _located(host: Host, text: str | None) -> Located[str] | None:
    return None if text is None else Located(text, host.span)


_VARIABLE_HINT = "use letters, digits and '_', and no digit at the start"
_VARIABLE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def check_environment_variable(context: Context) -> Iterator[Diagnostic]:
    """Check the environment variables of processes, hosts and executables."""
    system = context.system
    executables = [node.executable for node in system.nodes if node.executable is not None]
    environments = [
        *(process.environment for process in system.processes),
        *(host.environment for host in system.hosts),
        *(executable.environment for executable in executables),
    ]
    for environment in environments:
        for name, _ in environment:
            if not is_unresolved(name.value) and not _VARIABLE_NAME.fullmatch(name.value):
                text = f"'{name}' is not a name of an environment variable"
                yield Diagnostic(ENVIRONMENT_VARIABLE, text, name.span, hint=_VARIABLE_HINT)
