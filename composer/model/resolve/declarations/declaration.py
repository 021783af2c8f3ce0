"""Declarations of nodes by a node type or an inline entry, before they have a name."""

from __future__ import annotations

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.language.tree import Entry, Mapping, Plain, Tree, plain
from composer.model import (
    Parameter,
    PeriodUnit,
    Port,
    PortKind,
    Timer,
    Transforms,
    UnknownKey,
)
from composer.model.resolve.declarations.implementation import Implementation, read_implementation
from composer.model.resolve.declarations.parameters import read_parameters
from composer.model.resolve.declarations.ports import read_ports, read_timers
from composer.model.resolve.declarations.reactions import NODE_EVENTS, Events, node_reactions
from composer.model.resolve.declarations.transforms import merged_transforms, read_transforms
from composer.model.resolve.qos import QosTable
from composer.model.resolve.source_folders import SourceFolders
from composer.model.resolve.tree_values import entries, flag, key, plain_text


@dataclass(frozen=True, slots=True)
class Declaration:
    """What all nodes of one type with the same variables share."""

    description: str
    implementation: Implementation
    parameters: tuple[Parameter, ...]
    ports: tuple[Port, ...]
    timers: tuple[Timer, ...]
    state: tuple[tuple[Located[str], Plain], ...]
    reactions: Events
    introspection: Tree | None = None
    only_declared: bool = False
    transforms: Transforms | None = None

    @property
    def gets_undeclared(self) -> bool:
        """Whether parameters and remappings reach a node that does not declare them."""
        implementation = self.implementation
        is_foreign = implementation.hosted_class or implementation.executable
        return is_foreign is not None and not self.only_declared


def declare(
    tree: Mapping, folders: SourceFolders, qos: QosTable, diagnostics: list[Diagnostic]
) -> Declaration:
    """Read the declaration of a node type or an inline node."""
    return Declaration(
        description=plain_text(tree.get("description")),
        implementation=read_implementation(tree, folders),
        parameters=read_parameters(tree.get("parameters")),
        ports=read_ports(tree, qos, diagnostics),
        timers=read_timers(tree, diagnostics),
        state=tuple((key(entry), plain(entry.value)) for entry in entries(tree.get("state"))),
        reactions=node_reactions(tree, diagnostics),
        introspection=tree.get("introspection"),
        only_declared=flag(tree.get("only_declared"), default=False),
        transforms=read_transforms(tree.entry("transforms")),
    )


_REFINED_SECTIONS = (*(kind.section for kind in PortKind), "timers")
_REPLACED_KEYS = ("description", "only_declared", *(name for name, _ in NODE_EVENTS))
_OVERLAID_KEYS = ("state", "arguments", "executable")
_TRANSFORMS = "transforms"
_PERIOD_KEYS = frozenset(unit.value for unit in PeriodUnit)


def refines(instance: Mapping) -> bool:
    """Return whether a node of a system changes more of its type than parameter values."""
    return any(
        entry.name in _REFINED_SECTIONS
        or entry.name in _REPLACED_KEYS
        or entry.name in _OVERLAID_KEYS
        or entry.name == _TRANSFORMS
        for entry in instance
    )


def refined(declared: Mapping, instance: Mapping) -> Mapping:
    """Return the tree of a node type with the changes of an instance.

    Each key of a port or timer in the instance replaces that of the type. Ports and timers that the
    type does not have are left out (see :func:`unknown_keys`).
    """
    changed = {entry.name: entry for entry in declared}
    for entry in instance:
        if entry.name in _REFINED_SECTIONS:
            if entry.name in changed:
                changed[entry.name] = _refined_section(changed[entry.name], entry)
        elif entry.name in _OVERLAID_KEYS:
            name = entry.name
            changed[name] = _overlaid(changed[name], entry) if name in changed else entry
        elif entry.name == _TRANSFORMS:
            changed[_TRANSFORMS] = merged_transforms(changed.get(_TRANSFORMS), entry)
        elif entry.name in _REPLACED_KEYS:
            changed[entry.name] = entry
    return Mapping(tuple(changed.values()), declared.span)


def unknown_keys(declared: Mapping, instance: Mapping) -> tuple[UnknownKey, ...]:
    """Return the ports and timers of the instance that its type does not have."""
    unknown: list[UnknownKey] = []
    for section in _REFINED_SECTIONS:
        given = entries(instance.get(section))
        if not given:
            continue
        known = dict.fromkeys(entry.name for entry in entries(declared.get(section)))
        unknown.extend(
            UnknownKey(section, key(entry), tuple(known))
            for entry in given
            if entry.name not in known
        )
    return tuple(unknown)


def _refined_section(declared: Entry, given: Entry) -> Entry:
    """Return a section of ports or timers, each overlaid with its entry in the instance."""
    changes = {entry.name: entry for entry in entries(given.value)}
    merged = tuple(
        _overlaid(entry, changes[entry.name]) if entry.name in changes else entry
        for entry in entries(declared.value)
    )
    return Entry(declared.key, Mapping(merged, declared.value.span))


def _overlaid(declared: Entry, given: Entry) -> Entry:
    """Return ``declared`` with the keys of ``given`` in place of its own."""
    if not isinstance(given.value, Mapping):
        return declared
    replaced = {entry.name for entry in given.value}
    if replaced & _PERIOD_KEYS:
        replaced |= _PERIOD_KEYS  # period and rate replace each other
    kept = (entry for entry in entries(declared.value) if entry.name not in replaced)
    return Entry(given.key, Mapping((*kept, *given.value), given.value.span))
