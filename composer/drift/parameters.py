"""Compares declared with observed parameter values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.diagnostics import shown
from composer.drift.drift import Drift, DriftKind
from composer.drift.snapshot import ObservedNode
from composer.model import Node, Parameter
from composer.source import Located
from composer.tree import Plain


def compare_parameters(node: Node, observed: ObservedNode) -> Iterator[Drift]:
    """Yield the declared parameters that the node does not have, and those with another value.

    Further parameters of the node, such as ``use_sim_time``, are ignored.
    """
    declared = _values(node.parameters)
    if observed.parameters is None:
        if declared:
            yield Drift(DriftKind.NO_ANSWER, node.full_name, "parameters", span=node.name.span)
        return
    names = {parameter.name.value for parameter, _ in declared}
    for parameter, value in declared + _values(node.undeclared_parameters):
        name = parameter.name.value
        subject = f"parameter {name}"
        if name in observed.parameters:
            live = observed.parameters[name]
            if not _same(value.value, live):
                yield Drift(
                    DriftKind.WRONG_PARAMETER,
                    node.full_name,
                    subject,
                    shown(value.value),
                    shown(live),
                    span=value.span,
                )
        elif name in names:
            yield Drift(
                DriftKind.MISSING_PARAMETER,
                node.full_name,
                subject,
                shown(value.value),
                span=parameter.name.span,
            )


def _values(parameters: Iterable[Parameter]) -> list[tuple[Parameter, Located[Plain]]]:
    return [(item, item.value) for item in parameters if item.value is not None]


def _same(declared: object, live: object) -> bool:
    """Return whether two values are equal in ROS: true is not 1, but 1 is 1.0."""
    if isinstance(declared, list) and isinstance(live, list):
        return len(declared) == len(live) and all(map(_same, declared, live))
    if isinstance(declared, bool) or isinstance(live, bool):
        return declared is live
    return declared == live
