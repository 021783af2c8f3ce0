"""Validate and expand ROS names.

The rules are those of design.ros2.org "Topic and Service name mapping" as rcl and rmw check them
(``rcl_validate_topic_name``, ``rmw_validate_namespace``, ``rmw_validate_node_name``). Functions
that end in ``_problem`` return None for a valid name, else what is wrong with it, worded to follow
the name ("contains a space").

This follows the design page where rcl is less strict: no ``__`` in topic names and namespaces, and
only a ``/`` after ``~``.
"""

from __future__ import annotations

import re
from collections.abc import Container
from fnmatch import fnmatchcase
from itertools import chain, count

#: rmw's limits in characters: the 255 of DDS minus the prefixes that ROS adds.
MAXIMUM_NODE_NAME_LENGTH = 255
MAXIMUM_NAMESPACE_LENGTH = 245
MAXIMUM_TOPIC_NAME_LENGTH = 247
#: The logger of what the program itself says. Those of nodes have the names of the nodes.
PROGRAM_LOGGER = "compose"

_RULE_PREFIX = re.compile(r"(\w+:(?!//))?((rostopic|rosservice)://)?")
_FOREIGN_CHARACTER = re.compile(r"[^A-Za-z0-9_]")
_VALID_PATH = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")


def free_name(name: str, taken: Container[str]) -> str:
    """Return the name, with a number if it is taken."""
    numbered = (f"{name}_{number}" for number in count(2))
    return next(free for free in chain([name], numbered) if free not in taken)


def node_name_problem(name: str) -> str | None:
    """Return why ``name`` is not a valid node name, or None."""
    return (
        _empty_problem(name)
        or _character_problem(name)
        or ("begins with a digit" if name[0].isdigit() else None)
        or _length_problem(name, MAXIMUM_NODE_NAME_LENGTH)
    )


def namespace_problem(name: str) -> str | None:
    """Return why ``name`` is not a valid absolute or relative namespace, or None."""
    if name == "/":
        return None
    return (
        _empty_problem(name)
        or ("begins with '~', which has no meaning in a namespace" if name[0] == "~" else None)
        or _path_problem(name.removeprefix("/"))
        or _length_problem(name, MAXIMUM_NAMESPACE_LENGTH)
    )


def topic_name_problem(name: str) -> str | None:
    """Return why ``name`` is not a valid name of a topic, service or action, or None.

    The name may be relative (``scan``), private (``~/scan``, ``~``) or absolute (``/scan``).
    """
    if name == "~":
        return None
    return (
        _empty_problem(name)
        or ("has no '/' after '~'" if name[0] == "~" and name[1] != "/" else None)
        or _path_problem(name.removeprefix("~").removeprefix("/"))
        or _length_problem(name, MAXIMUM_TOPIC_NAME_LENGTH)
    )


def parameter_name_problem(name: str) -> str | None:
    """Return why ``name`` is not a valid parameter name, or None.

    rcl accepts any text that is not empty. This requires words joined by dots, since parameter
    files and expressions cannot use other names.
    """
    if not name:
        return "is empty"
    tokens = name.split(".")
    if not all(tokens):
        return "has an empty part between dots"
    return next((found for found in map(_token_problem, tokens) if found), None)


def expand_name(name: str, node_name: str, namespace: str) -> str:
    """Return the absolute name of ``name`` in a node, as ``rcl_expand_topic_name`` does.

    ``{node}``, ``{ns}`` and ``{namespace}`` are not substituted: braces are expressions here.
    """
    if name.startswith("/"):
        return name
    if name == "~" or name.startswith("~/"):
        return join(join(namespace, node_name), name[2:])
    return join(namespace, name)


def remapped_name(source: str) -> str:
    """Return the name that a remapping rule of rcl replaces.

    It may follow a node of the program and a kind of channel: ``lidar:scan``, ``rostopic://scan``.
    """
    return _RULE_PREFIX.sub("", source, count=1)


def join(namespace: str, relative: str) -> str:
    """Return ``relative`` below ``namespace``; an absolute name is returned as it is."""
    if relative.startswith("/"):
        return relative
    base = "/" + namespace.strip("/")
    return join_node_name(base, relative) if relative else base


def join_node_name(namespace: str, name: str) -> str:
    """Return the full name of a node."""
    return f"{namespace.rstrip('/')}/{name}"


def split_node_name(full_name: str) -> tuple[str, str]:
    """Return the namespace and the name of a node."""
    namespace, _, name = full_name.rpartition("/")
    return namespace or "/", name


def is_hidden(name: str) -> bool:
    """Return whether ROS tools hide ``name`` by default: a part begins with an underscore."""
    return name.startswith("_") or "/_" in name


def matches_wildcard(pattern: str, part: str) -> bool:
    """Return whether ``part`` of a name matches ``pattern``, in which ``*`` is any text."""
    pieces = pattern.split("*")
    if len(pieces) == 1:
        return pattern == part
    first, *middle, last = pieces
    if len(part) < len(first) + len(last) or not part.startswith(first):
        return False
    rest = part[len(first) : len(part) - len(last)]
    for piece in middle:
        found = rest.find(piece)
        if found < 0:
            return False
        rest = rest[found + len(piece) :]
    return part.endswith(last)


def is_selected(full_name: str, target: str) -> bool:
    """Return whether a user who types ``target`` means the node or system with a full name.

    A target is a full name, the last part or parts of one, or a pattern of either: ``/planning/*``,
    ``*_driver``.
    """
    if "/" not in target:
        return fnmatchcase(full_name.rpartition("/")[2], target)
    return fnmatchcase(full_name, target if target.startswith("/") else f"*/{target}")


def is_pattern(target: str) -> bool:
    """Return whether a target may stand for several names."""
    return any(character in target for character in "*?[")


def _empty_problem(name: str) -> str | None:
    return "is empty" if not name else None


def _length_problem(name: str, maximum: int) -> str | None:
    return f"has {len(name)} characters, more than {maximum}" if len(name) > maximum else None


def _character_problem(text: str) -> str | None:
    match = _FOREIGN_CHARACTER.search(text)
    if match is None:
        return None
    return f"contains {_shown(match[0])}; letters, digits and '_' are allowed"


def _path_problem(path: str) -> str | None:
    """Check the parts between slashes."""
    if _VALID_PATH.fullmatch(path) and "__" not in path:
        return None
    *_, last = tokens = path.split("/")
    if not last:
        return "ends with '/'"
    problem = next((found for found in map(_token_problem, tokens) if found), None)
    return problem or ("contains '__'" if "__" in path else None)


def _token_problem(token: str) -> str | None:
    if not token:
        return "has an empty part between slashes"
    return _character_problem(token) or (
        f"has a part that begins with a digit: '{token}'" if token[0].isdigit() else None
    )


def _shown(character: str) -> str:
    if character == " ":
        return "a space"
    return f"'{character}'" if character.isprintable() else f"U+{ord(character):04X}"
