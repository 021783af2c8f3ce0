"""The values of parameter files, by the names of nodes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Mapping as Map
from dataclasses import dataclass, field

from composer.model import USE_SIM_TIME, Node, UnmatchedParameters
from composer.names import join
from composer.source import Located, SourceFile
from composer.tree import Entry

#: Parameters that every ROS node declares, and that the composer ignores.
_OF_EVERY_NODE = ("start_type_description_service", "qos_overrides.")


@dataclass(frozen=True, slots=True)
class Section:
    """The values under one node name.

    ``listed_in`` is the system whose ``parameter_files`` name the file, if any. ``number`` is the
    position among all sections.
    """

    name: Located[str]  # absolute
    values: Map[str, Entry]
    listed_in: SourceFile | None
    number: int

    @property
    def is_pattern(self) -> bool:
        """Whether the name has wildcards."""
        return "*" in self.name.value

    def matches(self, full_name: str) -> bool:
        """Return whether the values are for the node ``full_name``."""
        return _is_match(_parts(self.name.value), _parts(full_name))


@dataclass(slots=True)
class ParameterFiles:
    """The sections of all files. The last value for a parameter takes effect."""

    _named: dict[str, list[Section]] = field(default_factory=dict)
    _patterns: list[Section] = field(default_factory=list)
    _count: int = 0

    @property
    def sections(self) -> list[Section]:
        """All sections, in order."""
        named = (section for sections in self._named.values() for section in sections)
        return sorted([*self._patterns, *named], key=lambda item: item.number)

    def add(
        self, name: Located[str], values: Map[str, Entry], listed_in: SourceFile | None
    ) -> None:
        """Append a section."""
        section = Section(name, values, listed_in, self._count)
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
        matching = (section for section in self._patterns if section.matches(full_name))
        found = [*self._named.get(full_name, ()), *matching]
        given: dict[str, Entry] = {}
        for section in sorted(found, key=lambda item: item.number):
            given.update(
                (name, entry)
                for name, entry in section.values.items()
                if name in declared
                or name == USE_SIM_TIME
                or not (section.is_pattern or _is_of_every_node(name))
            )
        return given

    def unmatched(self, nodes: Iterable[Node]) -> tuple[UnmatchedParameters, ...]:
        """Return the sections, and parameters of patterns, that are for none of the nodes."""
        by_name = {node.full_name: node for node in nodes}
        return tuple(found for section in self.sections for found in _unmatched(section, by_name))


def _unmatched(section: Section, nodes: Map[str, Node]) -> Iterator[UnmatchedParameters]:
    if section.is_pattern:
        matching = [node for name, node in nodes.items() if section.matches(name)]
    else:
        matching = [nodes[section.name.value]] if section.name.value in nodes else []
    renamed = next(_renamed(section, nodes.values()), None)
    if renamed is not None or not matching:
        yield UnmatchedParameters(section.name, None, tuple(nodes), renamed)
    if matching and section.is_pattern and all(node.complete for node in matching):
        declared = dict.fromkeys(
            parameter.name.value for node in matching for parameter in node.parameters
        )
        for name, entry in section.values.items():
            if name not in declared and name != USE_SIM_TIME and not _is_of_every_node(name):
                place = Located(name, entry.key.span)
                yield UnmatchedParameters(section.name, place, tuple(declared))


def _renamed(section: Section, nodes: Iterable[Node]) -> Iterator[str]:
    """Yield the nodes that only miss the values because an include gave them a prefix."""
    for node in nodes:
        place = node.name.span
        if place.file != section.listed_in or section.matches(node.full_name):
            continue
        text = place.file.line(place.line)[place.column - 1 :][: place.length].strip("'\"")
        own_name = text if node.name.value.endswith(text) else ""
        if own_name and section.matches(join(node.namespace.value, own_name)):
            yield node.full_name


def _is_of_every_node(parameter: str) -> bool:
    return parameter.startswith(_OF_EVERY_NODE)


def _parts(name: str) -> tuple[str, ...]:
    return tuple(name.strip("/").split("/"))


def _is_match(pattern: Sequence[str], parts: Sequence[str]) -> bool:
    """Return whether a name matches a pattern, both as parts. No exponential backtracking."""
    ends = {0}  # the possible numbers of parts matched so far
    for piece in pattern:
        if piece == "**":
            ends = set(range(min(ends), len(parts) + 1)) if ends else set()
        else:
            ends = {end + 1 for end in ends if end < len(parts) and piece in ("*", parts[end])}
    return len(parts) in ends
