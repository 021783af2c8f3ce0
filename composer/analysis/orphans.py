"""Methods that look like handlers and belong to nothing."""

from __future__ import annotations

from composer.analysis.behaviors import GENERAL_HANDLERS, handlers
from composer.behavior_source import BehaviorSource, Method
from composer.model import Node

_PREFIXES = ("on_", "accept_")


def orphans(node: Node, source: BehaviorSource) -> list[Method]:
    """Return the methods called ``on_...`` or ``accept_...`` that nothing of the node calls."""
    called = {handler.name for handler in handlers(node)} | GENERAL_HANDLERS.keys()
    return [
        method
        for method in source.methods
        if method.name.startswith(_PREFIXES) and method.name not in called
    ]
