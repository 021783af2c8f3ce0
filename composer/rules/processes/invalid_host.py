"""An address, a user, a workspace or a ROS domain of a host that cannot be used."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error
from composer.model import Host
from composer.model.hosts import domain_problem, login_problem, workspace_problem
from composer.source import Located

RULE = error(
    code="RC492",
    name="invalid-host",
    summary="A host has an invalid address, user or ROS domain, or an unsafe workspace.",
    why=(
        "'compose sync' copies the project to the workspace and may delete other files there, "
        "so it must be a folder of its own. Addresses and users are words of command lines."
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
    checks: tuple[tuple[str, Located[str] | None, Callable[[str], str | None], str | None], ...] = (
        ("address", host.address, login_problem, None),
        ("user", host.user, login_problem, None),
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
