"""How a launch file runs the process of a node: what launch's ExecuteLocal has been given."""

from __future__ import annotations

from typing import Any

from launch import LaunchContext
from launch.actions import EmitEvent, Shutdown
from launch.events import Shutdown as ShutdownEvent
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import perform_typed_substitution

#: What launch waits for after a signal by default, in seconds.
_SIGNAL_TIMEOUT_S = 5.0


def process_options(node: Any, context: LaunchContext) -> dict[str, Any]:
    """Return the options that differ from the defaults, and whether they end the launch.

    Times are in seconds. ``left_out`` are options that a system does not have.
    """
    options = _Options(node, context)
    found: dict[str, Any] = {"left_out": list(options.left_out())}
    if options.respawns:
        delay = options.attribute("respawn_delay")
        found["respawn_delay"] = 0.0 if delay is None else float(options.text(delay))
        found["respawn_max_retries"] = int(options.attribute("respawn_max_retries") or -1)
    for name in ("sigterm_timeout", "sigkill_timeout"):
        timeout_s = float(options.text(options.attribute(name) or str(_SIGNAL_TIMEOUT_S)))
        if timeout_s != _SIGNAL_TIMEOUT_S:
            found[name] = timeout_s
    found["cwd"] = options.text(node.cwd) if node.cwd else None
    found["ends_launch"] = any(map(_is_shutdown, options.on_exit))
    return found


class _Options:
    """The attributes of ExecuteLocal, which are private."""

    def __init__(self, node: Any, context: LaunchContext) -> None:
        self._node = node
        self._context = context

    @property
    def respawns(self) -> bool:
        return bool(
            perform_typed_substitution(self._context, self.attribute("respawn") or False, bool)
        )

    @property
    def on_exit(self) -> list[Any]:
        given = self.attribute("on_exit")
        return list(given) if isinstance(given, list | tuple) else [given] if given else []

    def attribute(self, name: str) -> Any:
        return getattr(self._node, f"_ExecuteLocal__{name}", None)

    def text(self, value: Any) -> str:
        if isinstance(value, int | float):
            return str(value)
        return str(perform_substitutions(self._context, normalize_to_list_of_substitutions(value)))

    def left_out(self) -> list[str]:
        found = []
        prefix = self.text(self._node.process_description.prefix)
        if prefix:
            found.append(f"prefix: {prefix}")
        if perform_typed_substitution(self._context, self._node.shell, bool):
            found.append("shell: the program runs without a shell")
        if self._node.env:
            found.append("env: the variables are added to the others, and do not replace them")
        others = (item for item in self.on_exit if not _is_shutdown(item))
        found += (f"on_exit: {getattr(item, '__name__', type(item).__name__)}" for item in others)
        return found


def _is_shutdown(item: Any) -> bool:
    is_event = isinstance(item, EmitEvent) and isinstance(item.event, ShutdownEvent)
    return is_event or isinstance(item, Shutdown)
