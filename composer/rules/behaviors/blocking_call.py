"""A handler that blocks its executor."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behaviors import GENERAL_HANDLERS, behaviors, calls_of, handlers
from composer.behavior_source import BehaviorSource, Call
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.source import Span

RULE = register(
    Rule(
        code="RC436",
        name="blocking-call",
        severity=Severity.WARNING,
        summary="A handler makes a blocking call, which blocks its executor.",
        why=(
            "While a handler blocks, no other callback of its executor runs: timers fire late, "
            "messages queue up, and a call to a node on the same executor never returns. Use "
            "'await' in an async handler, or a timer."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 1000}}
# file: counter.py
import time


class Counter:
    def on_tick(self):
        time.sleep(0.5)
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 1000}}
# file: counter.py
class Counter:
    async def on_tick(self):
        await self.clock.sleep(0.5)
""",
    )
)

_BLOCKING = re.compile(
    r"time\.sleep|input|os\.system|os\.wait|os\.waitpid"
    r"|subprocess\.(run|call|check_call|check_output|getoutput|getstatusoutput)"
    r"|requests\.(get|post|put|patch|delete|head|options|request)"
    r"|urllib\.request\.(urlopen|urlretrieve)"
    r"|socket\.create_connection"
    r"|rclpy\.(spin|spin_once|spin_until_future_complete)"
    r"|(.+\.)?spin_until_future_complete"
    r"|(.+\.)?(sock|socket|connection|conn)\.(recv|recvfrom|recv_into|accept|connect)"
)
#: rclpy's synchronous call; calls through the composer's clients are awaited.
_SYNCHRONOUS_CALL = re.compile(r"(.+\.)?\w*(client|cli)\.call")


def check(context: Context) -> Iterator[Diagnostic]:
    """Check what the handlers of every behavior call, directly or through their own methods."""
    for node, source in context.once(behaviors):
        places = dict.fromkeys(GENERAL_HANDLERS, source.reference.text.span)
        places |= {handler.name: handler.of.span for handler in handlers(node)}
        seen: set[Span] = set()
        for name, place in places.items():
            yield from _handler(source, name, place, seen)


def _handler(
    source: BehaviorSource, name: str, place: Span, seen: set[Span]
) -> Iterator[Diagnostic]:
    """Report each call once, for the first handler that reaches it."""
    method = source.method(name)
    for call in calls_of(source, method) if method is not None else ():
        if _blocks(call) and call.span not in seen and _is_imported(source, call):
            seen.add(call.span)
            yield Diagnostic(
                RULE,
                f"handler '{name}' of '{source.reference.class_name}' blocks in '{call.name}'",
                call.span,
                (Label(place, "called here"),),
                _hint(call),
            )


def _is_imported(source: BehaviorSource, call: Call) -> bool:
    """Return whether a name is imported; one that is not defined is reported by another rule."""
    head = call.name.partition(".")[0]
    if head not in sys.stdlib_module_names:
        return True
    imports = re.compile(rf"\b(import|from)\b.*\b{head}\b")
    return any(imports.search(module.source.text) for module in source.own_modules)


def _blocks(call: Call) -> bool:
    if call.awaited or call.deferred:
        return False
    return bool(_BLOCKING.fullmatch(call.name) or _SYNCHRONOUS_CALL.fullmatch(call.name))


def _hint(call: Call) -> str:
    if call.name == "time.sleep":
        return "use 'await self.clock.sleep(...)' in an async handler"
    return "await a non-blocking call, or use a timer"
