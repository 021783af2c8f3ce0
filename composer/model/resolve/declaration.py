"""Declarations of nodes by a node type or an inline entry, before they have a name."""

from __future__ import annotations

from pathlib import Path

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.language.tree import (
    Entry,
    Mapping,
    Plain,
    Scalar,
    Sequence,
    Tree,
    choice,
    entries,
    environment,
    flag,
    key,
    number,
    plain,
    plain_text,
    text,
    texts,
    value_or,
    word,
)
from composer.model import (
    BehaviorReference,
    Component,
    Executable,
    ExecutableKind,
    External,
    HostedClass,
    LifecycleKind,
    Parameter,
    PeriodUnit,
    Port,
    PortKind,
    Timer,
    Transforms,
    UnknownKey,
)
from composer.model.resolve.parameters import read_parameters
from composer.model.resolve.ports import NODE_EVENTS, Events, PortReader
from composer.model.resolve.qos import QosTable
from composer.model.resolve.transforms import merged_transforms, read_transforms
from composer.project.node_types import SourceFolders

#: Compiling and checking an expression takes the time of this many values, and of one more for a
#: few of its characters.
_VALUES_PER_EXPRESSION = 20
_CHARACTERS_PER_VALUE = 2
_REFINED_SECTIONS = (*(kind.section for kind in PortKind), "timers")
_REPLACED_KEYS = ("description", "only_declared", *(f"on_{event}" for event in NODE_EVENTS))
_OVERLAID_KEYS = ("state", "arguments", "executable", "component")
_TRANSFORMS = "transforms"
_PERIOD_KEYS = frozenset(unit.value for unit in PeriodUnit)


@dataclass(frozen=True, slots=True)
class Implementation:
    """What a declaration says about its implementation.

    If it has several, it is not clear which of them counts: they are only ``conflicting`` keys.
    """

    behavior: BehaviorReference | None = None
    hosted_class: HostedClass | None = None
    executable: Executable | None = None
    component: Component | None = None
    conflicting: tuple[Located[str], ...] = ()


def read_implementation(tree: Mapping, folders: SourceFolders) -> Implementation:
    """Return the implementation of a node type or an inline node."""
    written = map(tree.entry, ("behavior", "class", "executable", "component"))
    several = [key(entry) for entry in written if entry is not None]
    if len(several) > 1:
        return Implementation(conflicting=tuple(several))
    behavior, hosted = text(tree.get("behavior")), text(tree.get("class"))
    arguments = tuple((key(entry), plain(entry.value)) for entry in entries(tree.get("arguments")))
    executable = tree.entry("executable")
    return Implementation(
        behavior=None if behavior is None else _reference(behavior, folders),
        hosted_class=None
        if hosted is None
        else HostedClass(_reference(hosted, folders), arguments),
        executable=None
        if executable is None or not isinstance(executable.value, Mapping)
        else _executable(executable, executable.value, folders.folder(executable.key.span)),
        component=_component(tree.entry("component")),
    )


def read_external(entry: Entry | None) -> External | None:
    """Return the settings of an external node; None if it is not external."""
    if entry is None:
        return None
    if isinstance(entry.value, Scalar):
        return External(entry.key.span) if entry.value.value is True else None
    tree = entry.value
    if not isinstance(tree, Mapping):
        return None
    return External(
        entry.key.span,
        lifecycle=value_or(choice(tree.get("lifecycle"), LifecycleKind), LifecycleKind.NONE),
        ready_timeout_ms=number(tree.get("ready_timeout_ms")),
    )


def _reference(written: Located[str], folders: SourceFolders) -> BehaviorReference:
    folder = folders.folder(written.span)
    node_folders = folders.node_types_for(written.span).project.node_folders
    return BehaviorReference(written, folder, node_folders)


def _executable(entry: Entry, tree: Mapping, folder: Path) -> Executable:
    default = Executable(entry.key.span, folder)
    return Executable(
        entry.key.span,
        folder,
        package=text(tree.get("package")),
        name=text(tree.get("name")),
        command=texts(tree.get("command")),
        arguments=_words(tree.get("arguments")),
        nodes=texts(tree.get("nodes")) if isinstance(tree.get("nodes"), Sequence) else None,
        environment=environment(tree.get("environment")),
        working_directory=text(tree.get("working_directory")),
        kind=value_or(choice(tree.get("kind"), ExecutableKind), default.kind),
        lifecycle=value_or(choice(tree.get("lifecycle"), LifecycleKind), LifecycleKind.NONE),
        ready_timeout_ms=number(tree.get("ready_timeout_ms")),
        sigterm_timeout_ms=value_or(
            number(tree.get("sigterm_timeout_ms")), default.sigterm_timeout_ms
        ),
        sigkill_timeout_ms=value_or(
            number(tree.get("sigkill_timeout_ms")), default.sigkill_timeout_ms
        ),
        given=tuple(key(item) for item in tree),
    )


def _component(entry: Entry | None) -> Component | None:
    if entry is None or not isinstance(entry.value, Mapping):
        return None
    tree = entry.value
    extra = entries(tree.get("extra_arguments"))
    return Component(
        entry.key.span,
        package=text(tree.get("package")),
        plugin=text(tree.get("plugin")),
        extra_arguments=tuple((key(item), plain(item.value)) for item in extra),
        lifecycle=value_or(choice(tree.get("lifecycle"), LifecycleKind), LifecycleKind.NONE),
        ready_timeout_ms=number(tree.get("ready_timeout_ms")),
    )


def _words(tree: Tree | None) -> tuple[Located[str], ...]:
    items = getattr(tree, "items", ())
    return tuple(Located(word(item), item.span) for item in items if isinstance(item, Scalar))


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
    size: int = 0  # in values: how much of the limit each node takes

    @property
    def gets_undeclared(self) -> bool:
        """Whether parameters and remappings reach a node that does not declare them."""
        implementation = self.implementation
        is_foreign = (
            implementation.hosted_class or implementation.executable or implementation.component
        )
        return is_foreign is not None and not self.only_declared


def declare(
    tree: Mapping, folders: SourceFolders, qos: QosTable, diagnostics: list[Diagnostic]
) -> Declaration:
    """Read the declaration of a node type or an inline node."""
    reader = PortReader(diagnostics, qos)
    return Declaration(
        description=plain_text(tree.get("description")),
        implementation=read_implementation(tree, folders),
        parameters=read_parameters(tree.get("parameters")),
        ports=reader.ports(tree),
        timers=reader.timers(tree),
        state=tuple((key(entry), plain(entry.value)) for entry in entries(tree.get("state"))),
        reactions=reader.reactions(tree),
        introspection=tree.get("introspection"),
        only_declared=flag(tree.get("only_declared"), default=False),
        transforms=read_transforms(tree.entry("transforms")),
        size=_size(tree),
    )


def _size(tree: Tree, name: str = "") -> int:
    """Return the number of keys and values under the key ``name``."""
    match tree:
        case Mapping(entries=entries):
            return 1 + len(entries) + sum([_size(entry.value, entry.name) for entry in entries])
        case Sequence(items=items):
            return 1 + sum([_size(item, name) for item in items])
        case Scalar(value=str() as text) if "{" in text or name in ("when", "accept"):
            return _VALUES_PER_EXPRESSION + len(text) // _CHARACTERS_PER_VALUE
        case _:
            return 1


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
