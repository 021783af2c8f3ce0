"""Leave out what is only reported because of another mistake."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from composer.analysis.consequences import Consequences, quoted
from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, Severity

_MAX_PLACES = 3  # in the labels of one diagnostic
_MANY = 3  # different unknown names: a file or a section is probably missing
_MAX_UNKNOWN = 20  # further unknown names in the labels of one diagnostic
_NEARBY_LINES = 3  # between the ends of a connection
_SEVERITIES = tuple(Severity)  # the most severe one first
#: The kinds of names that are declared elsewhere, with what a name of that kind should be.
_DECLARED = {
    "executor": "an executor of this system",
    "node": "a node of this system",
    "process": "a process of this system",
    "QoS profile": "a QoS profile",
}
_PORT = re.compile(r"'(?:[^'.]*\.)?(?:on_|accept_)?([^'.]+)'")
_INTERFACE = re.compile(r"^([a-z][a-z0-9_]*)/\w+/\w+ has no ")

#: What is reported of a port that is declared in the wrong section.
_OF_WRONG_KIND = frozenset(
    {
        "duplicate-server",
        "handler-without-port",
        "idle-port",
        "missing-handler",
        "port-connected-twice",
        "unknown-attribute",
        "unknown-key",
    }
)
#: The info about what nothing uses; a mistake elsewhere in the file may be the reason.
_UNUSED = "unused-declaration"


def without_follow_ups(
    found: list[Diagnostic], context: Context, of_project: Iterable[Diagnostic] = ()
) -> list[Diagnostic]:
    """Return the diagnostics of a system without those that follow from others.

    Settings of the project may be the cause, too.
    """
    consequences = Consequences((*found, *of_project), context)
    wrong_ports = _ports_of_wrong_kind(found)
    wrong_files = {
        item.primary.file.path for item in found if item.severity is Severity.ERROR
    } & _files_of_infos(found)
    is_misplaced = any(_names_no_node(item) for item in found)
    kept = [
        item
        for item in found
        if not consequences.include(item)
        and not (is_misplaced and item.rule.name == "unmeasured-chain")
        and not (item.rule.name in _OF_WRONG_KIND and _mentions(item, wrong_ports))
        and not (item.rule.name == _UNUSED and item.primary.file.path in wrong_files)
    ]
    return _joined(_without_ports(_without_sections(kept)), context)


def _names_no_node(item: Diagnostic) -> bool:
    """Return whether a process lacks nodes, because it names what is not one."""
    return {"node", "process"} == {kind for kind, _ in item.subjects}


def _without_sections(found: list[Diagnostic]) -> list[Diagnostic]:
    """Leave out sections of parameter files for nodes that connections do not find either."""
    unknown = {
        name for item in found if item.rule.name == "unknown-node" for _, name in item.subjects[:1]
    }
    return [
        item
        for item in found
        if item.rule.name != "unmatched-parameters"
        or not unknown.intersection(name.rpartition("/")[2] for name in _named(item)[:1])
    ]


def _without_ports(found: list[Diagnostic]) -> list[Diagnostic]:
    """Leave out unknown ports in a loop of connections, with a node of the same wrong value."""
    nodes = [item for item in found if _is_in_loop(item, "unknown-node")]
    return [
        item
        for item in found
        if not _is_in_loop(item, "unknown-port")
        or not any(
            _named(item)[-1] in dict(node.subjects).get("node", "")
            and node.primary.file == item.primary.file
            and abs(node.primary.line - item.primary.line) <= _NEARBY_LINES
            for node in nodes
        )
    ]


def _is_in_loop(item: Diagnostic, rule: str) -> bool:
    return item.rule.name == rule and "${" in item.primary.text


def _named(item: Diagnostic) -> list[str]:
    return quoted(item.message) or [""]


def _ports_of_wrong_kind(found: Iterable[Diagnostic]) -> frozenset[str]:
    """Return the names of ports that connections expect to be of another kind."""
    labels = (
        label for item in found if item.rule.name == "wrong-port-kind" for label in item.related
    )
    return frozenset(label.span.text for label in labels)


def _mentions(item: Diagnostic, ports: frozenset[str]) -> bool:
    return bool(ports) and not ports.isdisjoint(_PORT.findall(item.message))


def _files_of_infos(found: Iterable[Diagnostic]) -> set[str]:
    return {item.primary.file.path for item in found if item.rule.name == _UNUSED}


def _joined(found: list[Diagnostic], context: Context) -> list[Diagnostic]:
    """Report what was probably renamed or removed in one place once, with all uses of it.

    The report is the first of the most severe ones, whatever the files are called.
    """
    groups: dict[tuple[str, ...], list[Diagnostic]] = {}
    for item in found:
        name = _renamed(item, context)
        if name is not None:
            groups.setdefault(name, []).append(item)
    for items in groups.values():
        items.sort(key=lambda item: _SEVERITIES.index(item.severity))
    repeated = {id(item): items for items in groups.values() if len(items) > 1 for item in items}
    found = list(_with_groups(found, repeated)) if repeated else found
    return _with_one_of_many(found)


def _renamed(item: Diagnostic, context: Context) -> tuple[str, ...] | None:
    """Return what a diagnostic is about: a field of the project, a variable, a name; or None."""
    match item.rule.name:
        case "unknown-field":
            interface = _INTERFACE.match(item.message)
            is_own = interface is not None and context.interfaces.source_folder(f"{interface[1]}/")
            return ("field", item.message) if is_own else None
        case "unknown-interface" | "unknown-import" | "module-not-installed":
            package = _named(item)[-1].partition("/")[0]
            is_missing = item.message.startswith("no module named") or "/" in _named(item)[-1]
            is_unknown = package not in context.interfaces.packages() and "." not in package
            return ("package", package) if is_missing and is_unknown else None
        case "unknown-variable":
            return ("variable", item.primary.file.path, item.message)
        case "unknown-port" if item.hint is not None:  # the ports that the node has instead
            port = next((name for name in _named(item) if name == item.primary.text), None)
            return ("port", port or _named(item)[-1], item.hint)
        case _:
            return item.subjects[0] if _is_undeclared(item) else None


def _is_undeclared(item: Diagnostic) -> bool:
    """Return whether a diagnostic is about a name that should be declared elsewhere."""
    is_unknown = item.rule.name in ("unknown-node", "undeclared-name")
    return is_unknown and bool(item.subjects) and item.subjects[0][0] in _DECLARED


def _with_one_of_many(found: list[Diagnostic]) -> list[Diagnostic]:
    """Report several unknown names of one kind once, unless they resemble others.

    One missing file or section is the reason for all of them, most likely.
    """
    unknown: dict[str, list[Diagnostic]] = {}
    for item in found:
        if _is_undeclared(item) and "did you mean" not in (item.hint or ""):
            unknown.setdefault(item.subjects[0][0], []).append(item)
    left_out: set[int] = set()
    first: dict[int, Diagnostic] = {}
    for kind, (item, *others) in unknown.items():
        if len(others) + 1 >= _MANY:
            left_out.update(map(id, others))
            labels = (
                Label(other.primary, f"'{other.subjects[0][1]}' is not {_DECLARED[kind]} either")
                for other in others[:_MAX_UNKNOWN]
            )
            first[id(item)] = replace(item, related=(*item.related, *labels))
    return [first.get(id(item), item) for item in found if id(item) not in left_out]


def _with_groups(
    found: Iterable[Diagnostic], groups: Mapping[int, list[Diagnostic]]
) -> Iterator[Diagnostic]:
    for item in found:
        first, *others = groups.get(id(item), [item])
        if item is first and others:
            labels = (Label(other.primary, "here too") for other in others[:_MAX_PLACES])
            yield replace(item, related=(*item.related, *labels))
        elif item is first:
            yield item
