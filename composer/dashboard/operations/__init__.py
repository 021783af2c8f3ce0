"""What a browser can request: each operation reads its request and returns what a thread runs.

To add an operation, add a function to one of the modules, and its line in ``OPERATIONS``.
"""

from __future__ import annotations

from composer.dashboard.context import Operation
from composer.dashboard.operations import calls, nodes

OPERATIONS: dict[str, Operation] = {
    "node": Operation(nodes.node),
    "plan": Operation(nodes.plan),
    "drift": Operation(nodes.drift),
    "transition": Operation(nodes.transition, changes=True),
    "restart": Operation(nodes.restart, changes=True),
    "command": Operation(nodes.command, changes=True),
    "form": Operation(calls.form),
    "fields": Operation(calls.fields),
    "call": Operation(calls.call, changes=True),
    "publish": Operation(calls.publish, changes=True),
    "set_parameter": Operation(calls.set_parameter, changes=True),
}
