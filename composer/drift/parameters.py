"""Compares declared with observed parameter values."""

from __future__ import annotations

from collections.abc import Iterator

from composer.diagnostics import shown
from composer.drift.drift import Drift, DriftKind
from composer.drift.snapshot import ObservedNode
from composer.model import Node


def compare_parameters(node: Node, observed: ObservedNode) -> Iterator[Drift]:
    """Yield the declared parameters that the node does not have, or has with another value.

    Further parameters of the node, such as ``use_sim_time``, are ignored.
    """
    valued = [parameter for parameter in node.parameters if parameter.value is not None]
    if not valued:
        return
    if observed.parameters is None:
        yield Drift(DriftKind.NO_ANSWER, node.full_name, "parameters", span=node.name.span)
        return
    for parameter in valued:
        name = parameter.name.value
        subject = f"parameter {name}"
        if parameter.value is None:
            continue
        value = parameter.value.value
        if name not in observed.parameters:
            yield Drift(
                DriftKind.MISSING_PARAMETER,
                node.full_name,
                subject,
                shown(value),
                span=parameter.name.span,
            )
        elif not _same(value, observed.parameters[name]):
            yield Drift(
                DriftKind.WRONG_PARAMETER,
                node.full_name,
                subject,
                shown(value),
                shown(observed.parameters[name]),
                span=parameter.value.span,
            )


def _same(declared: object, live: object) -> bool:
    """Return whether two values are equal in ROS: true is not 1, but 1 is 1.0."""
    if isinstance(declared, list) and isinstance(live, list):
        return len(declared) == len(live) and all(map(_same, declared, live))
    if isinstance(declared, bool) or isinstance(live, bool):
        return declared is live
    return declared == live
