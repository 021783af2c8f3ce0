"""Read ROS parameter files: parameter values by the full names of nodes.

The format follows ``rcl_yaml_param_parser``: a map of node names, each with ``ros__parameters``.
``*`` is one part of a name, ``**`` any number of parts. Namespaces and parameters with dots in
their names may be nested maps.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from composer.base.diagnostics import (
    Diagnostic,
    Label,
    Severity,
    Subject,
    error,
    nearest,
    shown,
    warning,
)
from composer.base.source import Located, SourceFile, Span, shown_path
from composer.language.document import read_parameter_document
from composer.language.tree import (
    Entry,
    Mapping,
    Scalar,
    Sequence,
    Tree,
    describe,
    is_opaque,
    texts,
)
from composer.model.names import node_name_problem
from composer.model.resolve.parameter_sections import ParameterFiles, Section
from composer.project import OUTSIDE_HINT, Project

__all__ = ["PARAMETER_FILES", "ParameterFiles", "read_parameter_file", "read_parameter_files"]

#: The values of all parameter files, of which some may be missing.
PARAMETER_FILES: Subject = ("parameter files", "")
PARAMETER_FILE = error("RC043", "parameter-file")
DUPLICATE_PARAMETER = warning("RC046", "duplicate-parameter")
PARAMETER_SUBSTITUTION = warning("RC045", "parameter-substitution")
PARAMETERS = "ros__parameters"
_MISSPELLED = ("parameters", "params", "ros_params", "ros__params", "ros_parameters")
_SUBSTITUTION = re.compile(r"\$\([a-z][a-z0-9_-]*(?: [^)]*)?\)|\$\{[^}]*\}")
SCALAR_TYPES: dict[type, str] = {bool: "bool", int: "integer", float: "double", str: "string"}


def read_parameter_files(
    tree: Tree | None, folder: Path, project: Project, diagnostics: list[Diagnostic]
) -> ParameterFiles:
    """Read the files that ``parameter_files`` names, relative to the system's folder."""
    files = ParameterFiles()
    for name in texts(tree):
        if is_opaque(name.value):
            continue
        path = folder / name.value
        if not project.holds(path):
            message = f"parameter file '{shown(name.value)}' is outside the project"
            found = [Diagnostic(PARAMETER_FILE, message, name.span, hint=OUTSIDE_HINT)]
        elif not path.exists():
            message = f"there is no parameter file '{shown(name.value)}'"
            found = [Diagnostic(PARAMETER_FILE, message, name.span)]
        else:
            found = read_parameter_file(path, files, name.span.file)
        # What is not read may be what a node needs.
        diagnostics += (
            replace(item, subjects=(PARAMETER_FILES,)) if item.severity is Severity.ERROR else item
            for item in found
        )
    return files


def read_parameter_file(
    path: Path, files: ParameterFiles, listed_in: SourceFile | None = None
) -> list[Diagnostic]:
    """Add the sections of the file at ``path``, and return its diagnostics.

    ``listed_in`` is the system whose ``parameter_files`` name the file.
    """
    content, diagnostics = read_parameter_document(path, shown_path(path))
    if content is not None:
        _Reader(files, listed_in, diagnostics).read(content)
    return diagnostics


class _Reader:
    """Reads one file."""

    def __init__(
        self, files: ParameterFiles, listed_in: SourceFile | None, diagnostics: list[Diagnostic]
    ) -> None:
        self._files = files
        self._listed_in = listed_in
        self._diagnostics = diagnostics
        self._last: dict[tuple[str, str], Span] = {}  # by node and parameter

    def read(self, tree: Mapping) -> None:
        """Read the whole file."""
        for entry in tree:
            if _is_parameters(entry):
                message = f"there is no node name above '{PARAMETERS}'"
                self._report(message, entry.key.span, "write '/**:' above it for all nodes")
            else:
                self._read_name(entry, entry.name)

    def _read_name(self, entry: Entry, name: str) -> None:
        """Read the entry of a node or namespace. Both can have the same name."""
        if not isinstance(entry.value, Mapping):
            self._report_no_parameters(entry)
            return
        misspelled = _misspelled_key(entry.value)
        if misspelled is not None:
            message = f"'{shown(misspelled.name)}' is not '{PARAMETERS}'"
            self._report(message, misspelled.key.span, f"did you mean '{PARAMETERS}'?")
            return
        leaves = any(not isinstance(item.value, Mapping) for item in entry.value)
        if leaves and not any(map(_is_parameters, entry.value)):
            self._report_no_parameters(entry)
            return
        outside = _next_to_parameters(entry.value)
        if outside is not None:
            message = f"'{shown(outside.name)}' is next to '{PARAMETERS}', not below it"
            self._report(message, outside.key.span, "indent it further")
            return
        for item in entry.value:
            if _is_parameters(item):
                self._read_section(Located(name, entry.key.span), item)
            else:
                self._read_name(item, f"{name.removesuffix('/')}/{item.name}")

    def _read_section(self, name: Located[str], entry: Entry) -> None:
        problem = _name_problem(name.value)
        if problem is not None:
            message = f"'{shown(name.value)}' is not the name of a node: it {problem}"
            hint = (
                "'*' stands for one part of a name, '**' for any number" if "*" in problem else None
            )
            self._report(message, name.span, hint)
        elif not isinstance(entry.value, Mapping):
            message = f"'{PARAMETERS}' is a map of parameters, found {describe(entry.value)}"
            self._report(message, entry.key.span, f"write '{PARAMETERS}: {{}}' for none")
        else:
            absolute = name.map(lambda text: f"/{text.removeprefix('/')}")
            values: dict[str, Entry] = {}
            for item in _flat(entry.value, ""):
                if self._check_value(item):
                    self._check_duplicate(absolute.value, item)
                    values[item.name] = item
            self._files.add(Section(absolute, values, self._listed_in))

    def _check_value(self, entry: Entry) -> bool:
        """Report what is wrong with the value, and return whether a parameter can have it."""
        name = shown(entry.name)
        items = entry.value.items if isinstance(entry.value, Sequence) else (entry.value,)
        scalars = [item for item in items if isinstance(item, Scalar)]
        nested = next((item for item in items if not isinstance(item, Scalar)), None)
        if nested is not None:
            message = f"parameter '{name}': a list of parameters cannot contain {describe(nested)}"
            return self._report(message, nested.span)
        if any(item.value is None for item in scalars):
            hint = "write '\"\"' for an empty string"
            return self._report(f"parameter '{name}' has no value", entry.key.span, hint)
        self._check_substitutions(scalars)
        return self._check_types(name, scalars)

    def _check_types(self, name: str, items: Iterable[Scalar]) -> bool:
        types = [(SCALAR_TYPES[type(item.value)], item.span) for item in items]
        other = next((item for item in types if item[0] != types[0][0]), None)
        if other is None:
            return True
        message = f"parameter '{name}': the values of a list must have one type, not {types[0][0]}"
        both = {other[0], types[0][0]}
        hint = "write integers as doubles: 1.0" if both == {"integer", "double"} else None
        return self._report(f"{message} and {other[0]}", other[1], hint)

    def _check_substitutions(self, items: Iterable[Scalar]) -> None:
        for item in items:
            match = _SUBSTITUTION.search(item.value) if isinstance(item.value, str) else None
            if match is not None:
                message = f"'{shown(match[0])}' is not replaced in parameter files"
                hint = (
                    "set this parameter in the system instead, where variables are replaced"
                    if match[0].startswith("${")
                    else "only launch files replace it; write the value, or set it in the system"
                )
                span = item.part(match.start(), len(match[0]))
                self._diagnostics.append(
                    Diagnostic(PARAMETER_SUBSTITUTION, message, span, hint=hint)
                )

    def _check_duplicate(self, node: str, entry: Entry) -> None:
        previous = self._last.get((node, entry.name))
        self._last[node, entry.name] = entry.key.span
        if previous is not None:
            message = f"parameter '{shown(entry.name)}' of '{shown(node)}' has a value already"
            label = Label(previous, "this value takes no effect")
            hint = "remove one of them"
            self._diagnostics.append(
                Diagnostic(DUPLICATE_PARAMETER, message, entry.key.span, (label,), hint)
            )

    def _report_no_parameters(self, entry: Entry) -> None:
        message = f"'{shown(entry.name)}' has no '{PARAMETERS}'"
        hint = f"write the parameters of a node below '{PARAMETERS}:'"
        self._report(message, entry.key.span, hint)

    def _report(self, message: str, span: Span, hint: str | None = None) -> bool:
        self._diagnostics.append(Diagnostic(PARAMETER_FILE, message, span, hint=hint))
        return False


def _is_parameters(entry: Entry) -> bool:
    # rcl compares the beginning of the key only.
    return entry.name.startswith(PARAMETERS)


def _misspelled_key(tree: Mapping) -> Entry | None:
    """Return the entry that is most likely meant to be ``ros__parameters``."""
    candidates = (
        entry
        for entry in tree
        if isinstance(entry.value, Mapping)
        and not _is_parameters(entry)
        and (entry.name in _MISSPELLED or nearest(entry.name, [PARAMETERS]) is not None)
    )
    return next((entry for entry in candidates if not _has_parameters(entry.value)), None)


def _next_to_parameters(tree: Mapping) -> Entry | None:
    """Return the first parameter that is not below ``ros__parameters``, if nothing is."""
    is_empty = any(_is_parameters(item) and _is_null(item.value) for item in tree)
    values = (item for item in tree if not isinstance(item.value, Mapping))
    others = (item for item in values if not _is_parameters(item))
    return next(others, None) if is_empty else None


def _is_null(tree: Tree) -> bool:
    return isinstance(tree, Scalar) and tree.value is None


def _has_parameters(tree: Tree) -> bool:
    return isinstance(tree, Mapping) and any(
        _is_parameters(entry) or _has_parameters(entry.value) for entry in tree
    )


def _name_problem(name: str) -> str | None:
    """Return why ``name`` does not name a node, with words that follow the name."""
    for part in name.removeprefix("/").split("/"):
        if part in ("*", "**"):
            continue
        problem = node_name_problem(part) if part else "has an empty part between slashes"
        if problem is not None:
            return problem
    return None


def _flat(tree: Mapping, prefix: str) -> Iterator[Entry]:
    """Yield the parameters of nested maps, with dotted names."""
    for entry in tree:
        name = f"{prefix}{entry.name}"
        inner = _map_of(entry.value)
        if inner is not None:
            yield from _flat(inner, f"{name}.")
        else:
            yield Entry(Scalar(name, entry.key.span, verbatim=False), entry.value)


def _map_of(tree: Tree) -> Mapping | None:
    """Return a map. As in rcl, it may be the only item of a list if its values are lists."""
    match tree:
        case Mapping():
            return tree
        case Sequence(items=(Mapping() as only,)) if only.entries:
            lists = all(isinstance(entry.value, Sequence) for entry in only)
            return only if lists else None
        case _:
            return None
