"""Leave out what is only reported because of another mistake."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from composer.analysis.consequences import Consequences, quoted
from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, Severity

_MAX_PLACES = 3  # in the labels of one diagnostic
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
#: What may only be reported because a folder of the project is missing.
_OF_FOLDERS = frozenset({"unknown-interface", "module-not-installed", "unknown-import"})
#: Infos about what nothing uses; a mistake elsewhere in the file may be the reason.
_UNUSED = frozenset({"unused-variable", "unused-executor", "unused-qos-profile"})


def without_follow_ups(
    found: list[Diagnostic], context: Context, of_project: Iterable[Diagnostic] = ()
) -> list[Diagnostic]:
    """Return the diagnostics of a system without those that follow from others.

    Settings of the project may be the cause, too.
    """
    consequences = Consequences(found, context)
    is_folder_missing = any("is not a folder" in item.message for item in of_project)
    skipped = _OF_FOLDERS if is_folder_missing else frozenset()
    if any(item.rule.name in ("parameter-file", "yaml-syntax") for item in found):
        skipped |= {"missing-parameter"}  # the file may set it
    wrong_ports = _ports_of_wrong_kind(found)
    wrong_files = {
        item.primary.file.path for item in found if item.severity is Severity.ERROR
    } & _files_of_infos(found)
    kept = [
        item
        for item in found
        if item.rule.name not in skipped
        and not consequences.include(item)
        and not (item.rule.name in _OF_WRONG_KIND and _mentions(item, wrong_ports))
        and not (item.rule.name in _UNUSED and item.primary.file.path in wrong_files)
    ]
    return _joined(_without_sections(kept), context)


def _without_sections(found: list[Diagnostic]) -> list[Diagnostic]:
    """Leave out sections of parameter files for nodes that connections do not find either."""
    unknown = {_named(item)[-1] for item in found if item.rule.name == "unknown-node"}
    return [
        item
        for item in found
        if item.rule.name != "unmatched-parameters"
        or not unknown.intersection(name.rpartition("/")[2] for name in _named(item)[:1])
    ]


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
    return {item.primary.file.path for item in found if item.rule.name in _UNUSED}


def _joined(found: list[Diagnostic], context: Context) -> list[Diagnostic]:
    """Report what was probably renamed in one place once, with all places that use it."""
    groups: dict[tuple[str, ...], list[Diagnostic]] = {}
    for item in found:
        name = _renamed(item, context)
        if name is not None:
            groups.setdefault((item.rule.code, *name), []).append(item)
    repeated = {id(item): items for items in groups.values() if len(items) > 1 for item in items}
    return list(_with_groups(found, repeated)) if repeated else found


def _renamed(item: Diagnostic, context: Context) -> tuple[str, ...] | None:
    """Return what a diagnostic is about: a field of the project, a variable or a node; or None."""
    match item.rule.name:
        case "unknown-field":
            interface = _INTERFACE.match(item.message)
            is_own = interface is not None and context.interfaces.source_folder(f"{interface[1]}/")
            return (item.message,) if is_own else None
        case "unknown-variable":
            return (item.primary.file.path, item.message)
        case "unknown-node":
            return (_named(item)[-1],)
        case _:
            return None


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
