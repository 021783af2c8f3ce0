"""The values of parameter files, by the names of nodes, which may have wildcards.

Patterns form a tree by their parts, so that a name is compared with those that begin like it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from collections.abc import Mapping as Map
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile
from composer.language.tree import Entry
from composer.model import USE_SIM_TIME, Node, UnmatchedParameters
from composer.model.names import join
from composer.model.qos_overrides import PREFIX, override_names

ONE_PART = "*"
ANY_PARTS = "**"
#: How parameters begin that every ROS node declares, and that the composer ignores.
_OF_EVERY_NODE = (
    "start_type_description_service",
    *(f"{PREFIX}{topic}." for topic in ("/clock", "/parameter_events", "/rosout")),
)


@dataclass(eq=False, slots=True)
class _Branch:
    """What follows a part of patterns. ``pattern`` ends here, if any."""

    is_any_parts: bool = False
    pattern: str | None = None
    following: dict[str, _Branch] = field(default_factory=dict)


class NamePatterns:
    """A set of patterns."""

    def __init__(self) -> None:
        self._root = _Branch()

    def add(self, pattern: str) -> None:
        """Add a canonical pattern."""
        branch = self._root
        for part in parts_of(pattern):
            branch = branch.following.setdefault(part, _Branch(is_any_parts=part == ANY_PARTS))
        branch.pattern = pattern

    def matching(self, name: str) -> list[str]:
        """Return the patterns that match the full name of a node."""
        if not self._root.following:
            return []
        branches = _with_no_parts([self._root])
        for part in parts_of(name):
            following = [branch for branch in branches if branch.is_any_parts]
            following += (
                branch.following[key]
                for branch in branches
                for key in (part, ONE_PART)
                if key in branch.following
            )
            branches = _with_no_parts(following)
        return [branch.pattern for branch in branches if branch.pattern is not None]


def is_pattern(name: str) -> bool:
    """Return whether a name has wildcards."""
    return "*" in name


def canonical(pattern: str) -> str:
    """Return an equal pattern in which no ``**`` follows another one."""
    parts = parts_of(pattern)
    kept = (
        part
        for part, previous in zip(parts, (None, *parts), strict=False)
        if (part, previous) != (ANY_PARTS, ANY_PARTS)
    )
    return f"/{'/'.join(kept)}"


def parts_of(name: str) -> tuple[str, ...]:
    """Return the parts of an absolute name or pattern."""
    return tuple(name.strip("/").split("/"))


def _with_no_parts(branches: Iterable[_Branch]) -> list[_Branch]:
    """Return the branches, and those after a ``**`` that stands for no part."""
    found = dict.fromkeys(branches)
    for branch in list(found):
        if ANY_PARTS in branch.following:
            found[branch.following[ANY_PARTS]] = None
    return list(found)


@dataclass(frozen=True, slots=True)
class Section:
    """The values under one node name.

    ``listed_in`` is the system whose ``parameter_files`` name the file, if any.
    """

    name: Located[str]  # absolute
    values: Map[str, Entry]
    listed_in: SourceFile | None


@dataclass(slots=True)
class ParameterFiles:
    """The sections of all files, in order. The last value for a parameter takes effect."""

    sections: list[Section] = field(default_factory=list)
    _values: dict[str, dict[str, tuple[int, Entry]]] = field(default_factory=dict)
    _patterns: NamePatterns = field(default_factory=NamePatterns)
    _count: int = 0

    def add(self, section: Section) -> None:
        """Append a section."""
        self.sections.append(section)
        name = canonical(section.name.value)
        if name not in self._values:
            self._values[name] = {}
            if is_pattern(name):
                self._patterns.add(name)
        for parameter, entry in section.values.items():
            self._values[name][parameter] = (self._count, entry)
            self._count += 1

    def given(self, full_name: str, declared: frozenset[str] | None = None) -> dict[str, Entry]:
        """Return the values for the node ``full_name``, by parameter.

        If all of its parameters are ``declared``, sections with wildcards give values for these and
        ``use_sim_time`` only, since others are for other nodes, and those of every ROS node are
        ignored.
        """
        found: dict[str, tuple[int, Entry]] = {}
        for name in self.names_for(full_name):
            values = self._values[name]
            for parameter in _wanted(name, values, declared):
                value = values[parameter]
                known = found.setdefault(parameter, value)
                found[parameter] = max(value, known, key=lambda item: item[0])
        in_order = sorted(found.items(), key=lambda item: item[1][0])
        return {parameter: entry for parameter, (_, entry) in in_order}

    def named(self, full_name: str) -> dict[str, Entry]:
        """Return the values in sections without wildcards for the node ``full_name``."""
        return {name: entry for name, (_, entry) in self._values.get(full_name, {}).items()}

    def joined(self) -> Iterator[tuple[str, list[Entry]]]:
        """Yield all sections; those of one name are joined at the place of the first, as in rcl."""
        for name, values in self._values.items():
            yield name, [entry for _, entry in values.values()]

    def unmatched(self, nodes: Iterable[Node]) -> tuple[UnmatchedParameters, ...]:
        """Return the sections, and parameters of patterns, that are for none of the nodes."""
        if not self.sections:
            return ()
        names = {name: node for node in nodes for name in (node.full_name, *node.inner_nodes)}
        search = _Search(self, names)
        return tuple(found for section in self.sections for found in search.unmatched(section))

    def names_for(self, full_name: str) -> list[str]:
        """Return the canonical names of the sections that are for the node ``full_name``."""
        named = [full_name] if full_name in self._values else []
        return named + self._patterns.matching(full_name)


class _Search:
    """Finds the nodes that each section is for."""

    def __init__(self, files: ParameterFiles, nodes: Map[str, Node]) -> None:
        self._full_names = tuple(nodes)
        self._matching: dict[str, list[Node]] = defaultdict(list)
        self._declared: dict[str, dict[str, None] | None] = {}
        #: Nodes that only miss the values of a section because an include gave them a prefix.
        self._renamed: dict[tuple[str, SourceFile], str] = {}
        for full_name, node in nodes.items():
            names = files.names_for(full_name)
            for name in names:
                self._matching[name].append(node)
            without_prefix = _name_without_prefix(node)
            for name in files.names_for(without_prefix) if without_prefix is not None else ():
                if name not in names:
                    self._renamed.setdefault((name, node.name.span.file), full_name)

    def unmatched(self, section: Section) -> Iterator[UnmatchedParameters]:
        """Yield the names of a section that match nothing."""
        name = canonical(section.name.value)
        renamed = self._renamed.get((name, section.listed_in)) if section.listed_in else None
        if renamed is not None or name not in self._matching:
            yield UnmatchedParameters(section.name, None, self._full_names, renamed)
        declared = self._declared_by(name) if is_pattern(name) else None
        if declared is None:
            return
        known = tuple(declared)
        for parameter, entry in section.values.items():
            if parameter not in declared and not _is_of_every_node(parameter):
                place = Located(parameter, entry.key.span)
                yield UnmatchedParameters(section.name, place, known)

    def _declared_by(self, pattern: str) -> dict[str, None] | None:
        """Return the parameters of all matching nodes, or None if they are not all known."""
        if pattern not in self._declared:
            nodes = self._matching.get(pattern, [])
            names = [parameter.name.value for node in nodes for parameter in node.parameters]
            names += (name for node in nodes for name in override_names(node.visible_ports))
            are_known = bool(nodes) and all(
                node.complete and not node.gets_undeclared for node in nodes
            )
            known = dict.fromkeys([*names, USE_SIM_TIME]) if are_known else None
            self._declared[pattern] = known
        return self._declared[pattern]


def _name_without_prefix(node: Node) -> str | None:
    """Return the full name without the prefixes of includes, or None if there are none.

    The text of the key in its file has no prefix. A prefix does not change a name of its own.
    """
    if node.own_name is not None:
        return None
    text = node.name.span.text
    if not text or text == node.name.value or not node.name.value.endswith(text):
        return None
    return join(node.namespace.value, text)


def _wanted(name: str, values: Map[str, object], declared: frozenset[str] | None) -> Iterable[str]:
    """Return the parameters of the section ``name`` that are for a node it matches."""
    if declared is None:
        return values
    if is_pattern(name):
        return [item for item in dict.fromkeys((*declared, USE_SIM_TIME)) if item in values]
    return [item for item in values if item in declared or not _is_of_every_node(item)]


def _is_of_every_node(parameter: str) -> bool:
    return parameter.startswith(_OF_EVERY_NODE)
