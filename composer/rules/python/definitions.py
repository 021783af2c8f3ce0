"""Examples of the rules on Python, and rules that are warnings at some places."""

from __future__ import annotations

from dataclasses import replace

from composer.diagnostics import Rule, Severity

_TIMER = "timers: {tick: {period_ms: 100}}"


def behavior(code: str, ports: str = _TIMER) -> str:
    """Return an example with node ``counter``, and the code of its behavior ``Counter``."""
    return (
        "# file: system.yaml\nsystem: behavior\nnodes:\n  counter:\n"
        f"    behavior: counter:Counter\n    {ports}\n# file: counter.py\n{code}"
    )


def on_tick(*statements: str, head: str = "", is_async: bool = False) -> str:
    """Return an example with the statements of one handler, after the text ``head``."""
    function = "async def" if is_async else "def"
    body = "".join(f"        {statement}\n" for statement in statements)
    before = f"{head}\n\n\n" if head else ""
    return behavior(f"{before}class Counter:\n    {function} on_tick(self):\n{body}")


def on_total(*lines: str, head: str = "from std_msgs.msg import Int32") -> str:
    """Return an example with a publisher ``count`` and a subscription ``total``, both Int32."""
    port = "{type: std_msgs/msg/Int32, qos: command, external: true}"
    ports = f"publishers: {{count: {port}}}\n    subscriptions: {{total: {port}}}"
    body = "".join(f"    {line}\n" if line else "\n" for line in lines)
    before = f"{head}\n\n\n" if head else ""
    return behavior(f"{before}class Counter:\n{body}", ports)


def rclpy_class(*statements: str, keys: str = "", head: str = "", methods: str = "") -> str:
    """Return an example with node ``talker``, and what its class ``Talker`` does at first."""
    body = "".join(f"        {statement}\n" for statement in statements)
    return (
        f"# file: system.yaml\nsystem: robot\nnodes:\n  talker:\n    class: robot_nodes:Talker\n"
        f"{keys}# file: robot_nodes.py\n{head}from rclpy.node import Node\n\n\n"
        f'class Talker(Node):\n    def __init__(self):\n        super().__init__("talker")\n'
        f"{body}{methods}"
    )


def as_warning(rule: Rule, *, unless: bool = False) -> Rule:
    """Return a rule as a warning, unless its problem certainly keeps a system from running."""
    return rule if unless else replace(rule, severity=Severity.WARNING)
