"""A policy that cannot be carried out for its node."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, warning
from composer.model import Node, OnFailure

RULE = warning(
    code="RC476",
    name="impossible-policy",
    summary="The 'on_failure' of a node cannot be carried out.",
    why=(
        "The system does not start external nodes, so it cannot restart them: with any policy "
        "but shutdown and ignore, it waits for them. A node with 'required: false' never ends "
        "the system."
    ),
    bad="""\
system: lidar
nodes:
  lidar:
    external: true
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}}
    lifecycle: {on_failure: restart}
""",
    good="""\
system: lidar
nodes:
  lidar:
    external: true
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, external: true}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the policies that nodes set themselves."""
    system = context.system
    for node in system.nodes:
        policy = node.supervision.on_failure
        if policy is None or policy is system.supervision.on_failure:
            continue
        problem = _problem(node)
        if problem is not None:
            yield Diagnostic(RULE, problem[0], policy.span, hint=problem[1])


def _problem(node: Node) -> tuple[str, str] | None:
    """Return what is wrong with the policy of a node, and what to do about it."""
    policy = node.supervision.policy
    if node.external is not None and policy is OnFailure.RESTART:
        hint = "remove it: with 'isolate', the node is used again once it is there again"
        return f"external node '{node.name}' cannot be restarted", hint
    if not node.required and policy is OnFailure.SHUTDOWN:
        hint = "remove 'required: false', or use 'isolate', 'restart' or 'ignore'"
        return f"node '{node.name}' is not required, so its failure ends nothing", hint
    return None
