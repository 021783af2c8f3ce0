"""How a launch file runs the process of a node: what launch's ExecuteLocal has been given."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
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
    given = _attribute(node, "on_exit")
    on_exit = list(given) if isinstance(given, list | tuple) else [given] if given else []
    found: dict[str, Any] = {
        "cwd": text_of(node.cwd, context) if node.cwd else None,
        "ends_launch": any(map(_is_shutdown, on_exit)),
        "left_out": list(_left_out(node, context, on_exit)),
    }
    retries = _attribute(node, "respawn_max_retries")
    if retries != 0 and perform_typed_substitution(
        context, _attribute(node, "respawn") or False, bool
    ):
        delay = _attribute(node, "respawn_delay")
        found["respawn_delay"] = 0.0 if delay is None else float(text_of(delay, context))
        found["respawn_max_retries"] = -1 if retries is None else int(retries)
    for name in ("sigterm_timeout", "sigkill_timeout"):
        timeout_s = float(text_of(_attribute(node, name), context) or _SIGNAL_TIMEOUT_S)
        if timeout_s != _SIGNAL_TIMEOUT_S:
            found[name] = timeout_s
    return found


def text_of(value: Any, context: LaunchContext) -> str:
    """Return a text, a number or substitutions as a text."""
    if isinstance(value, int | float):
        return str(value)
    return str(perform_substitutions(context, normalize_to_list_of_substitutions(value or "")))


def _attribute(node: Any, name: str) -> Any:
    """Return what ExecuteLocal has been given; it has no public attribute for that."""
    return getattr(node, f"_ExecuteLocal__{name}", None)


def _left_out(node: Any, context: LaunchContext, on_exit: Iterable[Any]) -> Iterator[str]:
    prefix = text_of(node.process_description.prefix, context)
    if prefix:
        yield f"prefix: {prefix}"
    if perform_typed_substitution(context, node.shell, bool):
        yield "shell: the program runs without a shell"
    if node.env:
        yield "env: the variables are added to the others, and do not replace them"
    for item in on_exit:
        if not _is_shutdown(item):
            yield f"on_exit: {getattr(item, '__name__', type(item).__name__)}"


def _is_shutdown(item: Any) -> bool:
    is_event = isinstance(item, EmitEvent) and isinstance(item.event, ShutdownEvent)
    return is_event or isinstance(item, Shutdown)
