"""Parameter values as declared and as a node tells them."""

from __future__ import annotations

from collections.abc import Iterator

from composer.diagnostics import shown
from composer.drift.report import Drift, DriftKind
from composer.drift.snapshot import NodeSeen
from composer.model import Node


def compare_parameters(node: Node, seen: NodeSeen) -> Iterator[Drift]:
    """Yield the declared parameters that the node lacks or has with another value.

    Those that it has beside them (``use_sim_time`` and the like) are nobody's concern.
    """
    valued = [parameter for parameter in node.parameters if parameter.value is not None]
    if not valued:
        return
    if seen.parameters is None:
        yield Drift(DriftKind.NO_ANSWER, node.full_name, "parameters", span=node.name.span)
        return
    for parameter in valued:
        name = parameter.name.value
        subject = f"parameter {name}"
        if parameter.value is None:
            continue
        value = parameter.value.value
        if name not in seen.parameters:
            yield Drift(
                DriftKind.MISSING_PARAMETER,
                node.full_name,
                subject,
                shown(value),
                span=parameter.name.span,
            )
        elif not _same(value, seen.parameters[name]):
            yield Drift(
                DriftKind.WRONG_PARAMETER,
                node.full_name,
                subject,
                shown(value),
                shown(seen.parameters[name]),
                span=parameter.value.span,
            )


def _same(declared: object, live: object) -> bool:
    """Say whether two values are the same to ROS: true is no number, but 1 is 1.0."""
    if isinstance(declared, list) and isinstance(live, list):
        return len(declared) == len(live) and all(map(_same, declared, live))
    if isinstance(declared, bool) or isinstance(live, bool):
        return declared is live
    return declared == live
