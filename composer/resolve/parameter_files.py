"""ROS parameter files: parameter values by the full names of nodes.

The format is that of ``rcl_yaml_param_parser``: a map of node names, each with ``ros__parameters``.
``*`` matches one part of a name, ``**`` any number of parts. Namespaces and parameters with dots in
their names may be nested maps.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from collections.abc import Mapping as Map
from dataclasses import dataclass, field
from pathlib import Path

from composer.diagnostics import Diagnostic, Rule, Severity, register, shown
from composer.document import read_document
from composer.model import USE_SIM_TIME
from composer.names import join, matches_wildcard
from composer.project import Project
from composer.resolve.tree_values import is_opaque, texts
from composer.source import Located, shown_path
from composer.tree import Entry, Mapping, Scalar, Tree

RULE = register(
    Rule(
        code="RC043",
        name="parameter-file",
        severity=Severity.ERROR,
        summary="A ROS parameter file cannot be read, or does not have the ROS format.",
        why=(
            "A parameter file is a map of node names, each with 'ros__parameters'. It must be in "
            "the project: files outside it may not exist on another computer."
        ),
        bad="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/motor: {speed: 2.0}
""",
        good="""\
# file: system.yaml
system: parameters
parameter_files: [robot.yaml]
nodes:
  motor: {parameters: {speed: {type: double, default: 1.0}}}
# file: robot.yaml
/motor: {ros__parameters: {speed: 2.0}}
""",
    )
)

PARAMETERS = "ros__parameters"
#: Parameters that every ROS node declares, and that the composer ignores.
_EVERY_NODE = re.compile(r"start_type_description_service|qos_overrides\..*")


@dataclass(frozen=True, slots=True)
class Section:
    """The values under one node name; ``number`` is the position among all sections."""

    name: Located[str]
    values: Map[str, Entry]
    number: int

    @property
    def is_pattern(self) -> bool:
        """Whether the name has wildcards."""
        return "*" in self.name.value


@dataclass(slots=True)
class ParameterFiles:
    """The sections of all files. The last value for a parameter takes effect."""

    _named: dict[str, list[Section]] = field(default_factory=dict)
    _patterns: list[Section] = field(default_factory=list)
    _count: int = 0

    def add(self, name: Located[str], values: Map[str, Entry]) -> None:
        """Append a section."""
        section = Section(name, values, self._count)
        self._count += 1
        if section.is_pattern:
            self._patterns.append(section)
        else:
            self._named.setdefault(name.value, []).append(section)

    def given(self, full_name: str, declared: frozenset[str]) -> dict[str, Entry]:
        """Return the values for the node ``full_name``, by parameter.

        Sections with wildcards give values for declared parameters and ``use_sim_time`` only, since
        others are for other nodes. Parameters of every ROS node are ignored unless declared.
        """
        found = [*self._named.get(full_name, ()), *self._matching(full_name)]
        given: dict[str, Entry] = {}
        for section in sorted(found, key=lambda item: item.number):
            given.update(
                (name, entry)
                for name, entry in section.values.items()
                if name in declared
                or name == USE_SIM_TIME
                or not (section.is_pattern or _EVERY_NODE.fullmatch(name))
            )
        return given

    def unmatched(self, full_names: frozenset[str]) -> tuple[Located[str], ...]:
        """Return the names of sections that match none of the nodes."""
        return tuple(
            section.name
            for name, sections in self._named.items()
            for section in sections
            if name not in full_names
        )

    def _matching(self, full_name: str) -> Iterator[Section]:
        parts = _parts(full_name)
        for section in self._patterns:
            if _is_match(_parts(section.name.value), parts):
                yield section


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
            diagnostics.append(Diagnostic(RULE, message, name.span))
        elif not path.exists():
            message = f"there is no parameter file '{shown(name.value)}'"
            diagnostics.append(Diagnostic(RULE, message, name.span))
        else:
            diagnostics.extend(read_parameter_file(path, files))
    return files


def read_parameter_file(path: Path, files: ParameterFiles) -> list[Diagnostic]:
    """Add the sections of the file at ``path``, and return its diagnostics."""
    content, _, diagnostics = read_document(path, shown_path(path))
    if content is not None:
        _read(content, "/", files, diagnostics)
    return diagnostics


def _read(
    tree: Mapping, namespace: str, files: ParameterFiles, diagnostics: list[Diagnostic]
) -> None:
    for entry in tree:
        name = join(namespace, entry.name)
        if not isinstance(entry.value, Mapping):
            message = f"'{shown(entry.name)}' has no '{PARAMETERS}'"
            diagnostics.append(Diagnostic(RULE, message, entry.key.span))
            continue
        parameters = entry.value.entry(PARAMETERS)
        if parameters is None:
            _read(entry.value, name, files, diagnostics)
        elif not isinstance(parameters.value, Mapping):
            message = f"'{PARAMETERS}' is a map of parameters"
            diagnostics.append(Diagnostic(RULE, message, parameters.key.span))
        else:
            values = {item.name: item for item in _flat(parameters.value, "")}
            files.add(Located(name, entry.key.span), values)


def _flat(tree: Mapping, prefix: str) -> Iterator[Entry]:
    """Yield the parameters of nested maps, with dotted names."""
    for entry in tree:
        name = f"{prefix}{entry.name}"
        if isinstance(entry.value, Mapping):
            yield from _flat(entry.value, f"{name}.")
        else:
            yield Entry(Scalar(name, entry.key.span, verbatim=False), entry.value)


def _parts(name: str) -> tuple[str, ...]:
    return tuple(name.strip("/").split("/"))


def _is_match(pattern: Sequence[str], parts: Sequence[str]) -> bool:
    """Return whether a name matches a pattern, both as parts. No exponential backtracking."""
    ends = {0}  # the possible numbers of parts matched so far
    for piece in pattern:
        if piece == "**":
            ends = set(range(min(ends), len(parts) + 1)) if ends else set()
        else:
            ends = {
                end + 1 for end in ends if end < len(parts) and matches_wildcard(piece, parts[end])
            }
    return len(parts) in ends
