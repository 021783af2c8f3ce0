"""Whether a system can run in virtual time: everything in this process, and on its clock."""

from __future__ import annotations

from collections.abc import Iterator

from composer.model import Node, System
from composer.runtime.intra_process.router import shared_channels
from composer.runtime.process import StartRefused

#: Nothing outside of the process takes part in a run.
ISOLATION = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}
_MAX_REASONS = 5


def check_virtual_time(system: System) -> None:
    """Raise StartRefused if a part of the system cannot run in virtual time."""
    reasons = list(_reasons(system))
    if not reasons:
        return
    more = f"; and {len(reasons) - _MAX_REASONS} more" * (len(reasons) > _MAX_REASONS)
    raise StartRefused(
        f"{system.name} cannot run in virtual time: {'; '.join(reasons[:_MAX_REASONS])}{more}",
        "run it in real time, without '--time virtual'",
    )


def _reasons(system: System) -> Iterator[str]:
    for node in system.nodes:
        kind = _kind_outside(node)
        if kind is not None:
            yield f"{node.full_name} {kind}, which has the time of the computer"
    for (kind, name), reason in shared_channels(system, in_virtual_time=True).items():
        if reason is not None:
            yield f"{kind.value} {name} needs the middleware: {reason}"


def _kind_outside(node: Node) -> str | None:
    if node.process is not None:
        return f"runs in process '{node.process}'"
    if node.external is not None:
        return "is an external node"
    if node.executable is not None:
        return "is an executable"
    if node.component is not None:
        return "is a component"
    if node.hosted_class is not None:
        return "is a class of rclpy"
    return None
