"""Keys that people write instead of the right ones, from other tools and from memory."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

from composer.diagnostics import nearest, suggestion

_INTENDED: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("frequency", "freq", "hz", "rate", "frequency_hz"), ("rate_hz",)),
    **dict.fromkeys(("period", "interval", "interval_ms", "period_s", "every"), ("period_ms",)),
    **dict.fromkeys(("subscriber", "subscribers", "subscribes"), ("subscriptions", "to")),
    "subscription": ("subscriptions", "to"),
    "publisher": ("publishers", "from"),
    "publishes": ("publishers", "publish"),
    **dict.fromkeys(("source", "sources"), ("from",)),
    **dict.fromkeys(("target", "targets", "sink", "sinks", "destination"), ("to",)),
    "from": ("server",),
    "to": ("clients",),
    "server": ("services", "action_servers"),
    "client": ("clients", "action_clients"),
    "actions": ("action_servers",),
    **dict.fromkeys(("params", "arguments", "args"), ("parameters",)),
    **dict.fromkeys(("remap", "remaps"), ("remappings",)),
    "ns": ("namespace",),
    **dict.fromkeys(("msg_type", "message_type", "srv_type", "action_type", "msg"), ("type",)),
    "interface": ("type",),
    **dict.fromkeys(("qos_profile", "profile"), ("qos",)),
    **dict.fromkeys(("queue_size", "queue_depth", "queue"), ("depth",)),
    "lease_duration": ("liveliness_lease_duration_ms",),
    **dict.fromkeys(("min", "min_value", "from_value"), ("minimum",)),
    **dict.fromkeys(("max", "max_value", "to_value"), ("maximum",)),
    **dict.fromkeys(("enum", "options", "values", "one_of"), ("choices",)),
    **dict.fromkeys(("value", "default_value", "initial"), ("default",)),
    "doc": ("description",),
    "if": ("when",),
    "condition": ("when", "accept"),
    "print": ("log",),
    **dict.fromkeys(("reply", "response", "answer"), ("respond", "on_response")),
    "send": ("publish", "call"),
    "on_error": ("on_failure",),
    "on_goal": ("accept",),
    **dict.fromkeys(("depends", "after", "requires"), ("depends_on",)),
    "auto_start": ("autostart",),
    **dict.fromkeys(("plugin", "class", "python", "script"), ("behavior",)),
    "num_threads": ("threads",),
    "memory": ("state",),
    "components": ("nodes",),
    "links": ("connections",),
}

_ADVICE: dict[tuple[str, str], str] = {
    ("node", "behavior"): "leave it out; a node with a type does what its type does",
    ("inline node", "variables"): "variables belong to a node with a 'type'",
    ("inline node", "topics"): "topics stand under 'publishers' and 'subscriptions'",
    ("node type", "topics"): "topics stand under 'publishers' and 'subscriptions'",
    ("inline node", "executable"): "a node is of a 'type', or declares its ports here",
    ("inline node", "package"): "a node is of a 'type', or declares its ports here",
    ("publisher", "publish"): "say it where it happens: a subscription, a timer, a service",
    ("subscription", "callback"): "say here what is done: when, set, log, publish, call",
    ("timer", "callback"): "say here what is done: when, set, log, publish, call",
    ("service", "when"): "leave it out; every request gets an answer",
}


def intended_key(name: str, valid: Iterable[str]) -> str | None:
    """Return the key among ``valid`` that ``name`` stands for, or None."""
    return _intended_key(name, frozenset(valid))


# A mistake is seldom made once.
@lru_cache(maxsize=1024)
def _intended_key(name: str, keys: frozenset[str]) -> str | None:
    known = next((key for key in _INTENDED.get(name.casefold(), ()) if key in keys), None)
    return known or nearest(name, keys)


def advice(name: str, owner: str, valid: Iterable[str]) -> str | None:
    """Return the hint for the key ``name``; ``owner`` is the title of what it stands in."""
    keys = set(valid)
    if (owner, name) in _ADVICE:
        return _ADVICE[owner, name]
    key = intended_key(name, keys)
    return f"did you mean '{key}'?" if key is not None else suggestion(name, keys, limit=12)
