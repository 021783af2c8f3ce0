"""Hints for keys and values that a schema refuses: what it expects, and what was probably meant."""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from functools import lru_cache
from typing import Any

from composer.base.diagnostics import nearest, suggestion

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
    **dict.fromkeys(("plugin", "python", "script"), ("behavior", "class")),
    **dict.fromkeys(("exec", "exe", "binary"), ("executable", "name")),
    **dict.fromkeys(("pkg", "ros_package"), ("package",)),
    **dict.fromkeys(("args", "argv"), ("arguments",)),
    **dict.fromkeys(("env", "env_vars"), ("environment",)),
    **dict.fromkeys(("cwd", "workdir"), ("working_directory",)),
    "num_threads": ("threads",),
    "memory": ("state",),
    "components": ("nodes",),
    "links": ("connections",),
    "xyz": ("translation_m",),
    "rpy": ("rotation_rad",),
}

_ADVICE: dict[tuple[str, str], str] = {
    ("node", "behavior"): "remove it; the type determines the behavior of a node",
    ("inline node", "variables"): "only a node with a 'type' has variables",
    ("inline node", "topics"): "declare topics under 'publishers' and 'subscriptions'",
    ("node type", "topics"): "declare topics under 'publishers' and 'subscriptions'",
    ("inline node", "package"): "write 'executable: {package: ..., name: ...}'",
    ("node type", "package"): "write 'executable: {package: ..., name: ...}'",
    ("node", "class"): "remove it; the type determines the class of a node",
    ("publisher", "publish"): "publish from a subscription, a timer or a service",
    ("subscription", "callback"): "declare the reaction here: when, set, log, publish, call",
    ("timer", "callback"): "declare the reaction here: when, set, log, publish, call",
    ("service", "when"): "remove it; every request gets a response",
}

#: Keys of the other end of a service or an action, by the title of the schema and the key: the
#: section that was probably meant.
_OTHER_SECTION: dict[tuple[str, str], str] = {
    (owner, key): section
    for owner, section, keys in (
        ("service", "clients", ("timeout_ms", "on_response", "on_failure")),
        ("client", "services", ("respond",)),
        (
            "action server",
            "action_clients",
            ("timeout_ms", "result_timeout_ms", "on_feedback", "on_result", "on_failure"),
        ),
        ("action client", "action_servers", ("accept", "feedback", "result")),
    )
    for key in keys
}

#: Example values for missing keys, by the title of the schema.
EXAMPLES = {
    **dict.fromkeys(
        (("publisher", "type"), ("subscription", "type")),
        "std_msgs/msg/String",
    ),
    **dict.fromkeys((("service", "type"), ("client", "type")), "std_srvs/srv/Trigger"),
    **dict.fromkeys(
        (("action server", "type"), ("action client", "type")),
        "composer_interfaces/action/Navigate",
    ),
    ("parameter", "type"): "double",
    ("feedback", "count"): "10",
    ("feedback", "period_ms"): "100",
    ("system", "nodes"): "{talker: {type: timer_source}}",
}
_SUBSTITUTION = r"\$\{"
_EXPRESSION = r"\{"
_WORDS = {
    "object": "a map",
    "array": "a list",
    "string": "a string",
    "number": "a number",
    "integer": "an integer",
    "boolean": "true or false",
    "null": "null",
}
_WORDS_FOR_TRUTH = frozenset({"yes", "no", "on", "off"})


def intended_key(name: str, valid: Iterable[str]) -> str | None:
    """Return the key among ``valid`` that ``name`` is most likely meant to be, or None."""
    return _intended_key(name, frozenset(valid))


# The same mistake is often repeated.
@lru_cache(maxsize=1024)
def _intended_key(name: str, keys: frozenset[str]) -> str | None:
    known = next((key for key in _INTENDED.get(name.casefold(), ()) if key in keys), None)
    return known or nearest(name, keys)


def other_section(name: str, owner: str) -> str | None:
    """Return the section whose ports have the key ``name``: the title ``owner`` lacks it."""
    return _OTHER_SECTION.get((owner, name))


def advice(name: str, owner: str, valid: Iterable[str]) -> str | None:
    """Return the hint for the unknown key ``name`` in a map with the title ``owner``."""
    keys = set(valid)
    if (owner, name) in _ADVICE:
        return _ADVICE[owner, name]
    section = other_section(name, owner)
    if section is not None:
        return f"ports under '{section}' have this key: declare this one there"
    key = intended_key(name, keys)
    return f"did you mean '{key}'?" if key is not None else suggestion(name, keys, limit=12)


def value_advice(path: Sequence[str | int], value: object) -> str | None:
    """Return the hint for a ``value`` of the wrong type at ``path``, or None."""
    *_, parent, key = ("", "", *path)
    if key == "lifecycle" and value in ("managed", "none"):
        return "write it in 'executable', 'component' or 'external' of the node"
    if key == "lifecycle" and isinstance(value, dict):
        return f"write these settings in 'lifecycle' of the node, next to '{parent}'"
    if parent == "parameters" and isinstance(value, dict) and value:
        return f"write a nested name with a dot: '{key}.{next(iter(value))}: ...'"
    items = value if isinstance(value, list) else [value]
    if key == "parameters" and any(isinstance(item, str) for item in items):
        return "list parameter files under 'parameter_files' of the system"
    if key == "namespace" and isinstance(value, list) and value:
        return f"write '{'/'.join(map(str, value))}'"
    return None


def expected(schema: dict[str, Any]) -> str:
    """Return the expected types, such as ``a number or an '{expression}'``.

    Load-time variables, which are allowed anywhere, are not mentioned.
    """
    words = [_WORDS[kind] for kind in _types(schema)]
    if schema.get("pattern") == _EXPRESSION:
        words.append("an '{expression}'")
    *most, last = words
    return f"{', '.join(most)} or {last}" if most else last


def type_hint(schema: dict[str, Any], found: object) -> str | None:
    """Return a hint how to fix ``found`` for common mistakes."""
    allowed = _types(schema)
    match found:
        case str():
            return _text_hint(schema, allowed.keys(), found)
        case bool() | int() | float() if allowed.keys() == {"string"}:
            return "quote it if it is a string"
        case list() if allowed.keys() == {"object"}:
            keys = schema.get("properties", {})
            if len(found) == len(keys) and not any(isinstance(item, dict) for item in found):
                pairs = zip(keys, found, strict=True)
                return f"write {{{', '.join(f'{key}: {item}' for key, item in pairs)}}}"
            return "write 'name: ...' for each, without a dash"
        case None if allowed.keys() == {"object"}:
            return "an empty map is written '{}'"
    return None


def _text_hint(schema: dict[str, Any], allowed: Set[str], found: str) -> str | None:
    if "boolean" in allowed:
        return "write true or false" if found.casefold() in _WORDS_FOR_TRUTH else None
    if found[:1].isdigit() and allowed & {"number", "integer"}:
        return "write the number alone; the key names the unit"
    if "object" in allowed and schema.get("pattern") == _EXPRESSION:
        return "name the field: {data: ...}"
    return "write a list: [...]" if "array" in allowed else None


def _types(schema: dict[str, Any]) -> dict[str, None]:
    """Return the JSON types that ``schema`` allows, in order, without text limited by a pattern."""
    types = schema.get("type", [])
    kinds = dict.fromkeys([types] if isinstance(types, str) else types)
    if "pattern" in schema and len(kinds) > 1:
        kinds.pop("string", None)
    return kinds
