"""The kinds of files, and their structure by JSON Schema: keys and types of values.

Editors use the same schemas (``schemas/``). Errors are reported with the location of the key or
value, in terms of the language.
"""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from composer.base.diagnostics import Diagnostic, error, nearest, shown
from composer.base.folders import schemas_folder
from composer.base.source import SourceFile
from composer.language import rules
from composer.language.rules import MAX_ERRORS
from composer.language.schema.explanations import explain_errors
from composer.language.schema.hints import intended_key
from composer.language.schema.validation import schema_errors
from composer.language.tree import Entry, Mapping, Scalar, Tree, plain

#: The kinds of files, each with a schema of that name and marked by a key of that name. A scenario
#: has the key ``system`` as well.
KINDS = ("scenario", "system", "node")
SCHEMAS = ("system", "node", "project", "scenario")
#: The schema of the output of ``compose validate --format json``.
REPORT = "report"
SYSTEM = "system"
NODE = "node"
SCENARIO = "scenario"

RULE = error("RC040", "wrong-kind-of-file")

_WORDS = {SYSTEM: "a system", NODE: "a node type", SCENARIO: "a scenario"}
_PARAMETERS = "it has parameters of nodes: list it in 'parameter_files' of a system"
_LAUNCH = "it is a launch file: 'compose import launch' makes a system of it"


def kind_of(tree: Mapping) -> str | None:
    """Return the kind of a file: ``scenario``, or else the first of its keys that is a kind."""
    names = [entry.name for entry in tree if entry.name in KINDS]
    return "scenario" if "scenario" in names else next(iter(names), None)


def check_schema(tree: Mapping, kind: str) -> list[Diagnostic]:
    """Return the schema diagnostics of a file of ``kind``.

    The tree has its variables expanded. A load-time variable without value is valid anywhere.
    """
    return explain_errors(schema_errors(plain(tree), schema(kind)), tree)


@cache
def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema (draft-07) called ``name``, of SCHEMAS or REPORT. Raises KeyError."""
    if name not in (*SCHEMAS, REPORT):
        raise KeyError(name)
    text = (schemas_folder() / f"{name}.schema.json").read_text(encoding="utf-8")
    content: dict[str, Any] = json.loads(text)
    return content


def check_kind(
    tree: Mapping, source: SourceFile, allowed: tuple[str, ...] = (SYSTEM, NODE)
) -> Diagnostic | None:
    """Return a diagnostic if the kind of a file is not one of ``allowed``."""
    kind = kind_of(tree)
    if kind in allowed:
        return None
    entry = (tree.entry(kind) if kind is not None else None) or next(iter(tree), None)
    if kind is None:
        message = f"'{source.path}' is not a system, a node type or a scenario"
    else:
        expected = " or ".join(_WORDS[name] for name in allowed)
        message = f"'{source.path}' is {_WORDS.get(kind, kind)}, not {expected}"
    possible = _WORDS if kind is None and len(allowed) > 1 else allowed
    hint = ", ".join(f"{_WORDS[name]} begins with '{name}: <name>'" for name in possible)
    if tree.entry("launch") is not None:
        hint = _LAUNCH
    elif any(_has_parameters(item.value) for item in tree):
        hint = _PARAMETERS
    return Diagnostic(RULE, message, entry.key.span if entry is not None else tree.span, hint=hint)


def _has_parameters(tree: Tree) -> bool:
    """Return whether this is a section of a parameter file, which may be in a namespace."""
    return isinstance(tree, Mapping) and any(
        entry.name.startswith("ros__parameters") or _has_parameters(entry.value) for entry in tree
    )


def with_intended_sections(tree: Mapping, kind: str) -> tuple[Mapping, list[Diagnostic]]:
    """Return a file of ``kind`` with its sections under their right names, and the diagnostics.

    Unknown keys that resemble no section stay as they are: ``check_schema`` reports them.
    """
    title, sections = _sections(kind)
    unknown = [entry.name for entry in tree if entry.name not in sections]
    if not unknown:
        return tree, []
    missing = [name for name in sections if tree.entry(name) is None]
    diagnostics = []
    entries = []
    compared = frozenset(unknown[:MAX_ERRORS])  # check_schema reports no more of them
    for entry in tree:
        meant = nearest(entry.name, missing) if entry.name in compared else None
        if meant is None or meant != intended_key(entry.name, missing):
            entries.append(entry)
            continue
        missing.remove(meant)
        message = f"'{shown(entry.name)}' is not a key of a {title}"
        hint = f"did you mean '{meant}'?"
        diagnostics.append(Diagnostic(rules.UNKNOWN_KEY, message, entry.key.span, hint=hint))
        entries.append(Entry(Scalar(meant, entry.key.span, verbatim=False), entry.value))
    return Mapping(tuple(entries), tree.span), diagnostics


@cache
def _sections(kind: str) -> tuple[str, tuple[str, ...]]:
    """Return the title of a kind of file, and its sections."""
    content = schema(kind)
    return content["title"], tuple(content["properties"])
