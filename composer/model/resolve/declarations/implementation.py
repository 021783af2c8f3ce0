"""Read what implements a node: ``behavior``, ``class``, ``executable`` or ``external``."""

from __future__ import annotations

from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree, plain
from composer.model import (
    BehaviorReference,
    Executable,
    ExecutableKind,
    External,
    HostedClass,
    LifecycleKind,
)
from composer.model.resolve.source_folders import SourceFolders
from composer.model.resolve.tree_values import (
    choice,
    entries,
    environment,
    key,
    number,
    text,
    texts,
    word,
)
from composer.project import Project


@dataclass(frozen=True, slots=True)
class Implementation:
    """What a declaration says about its implementation.

    If it has several, it is not clear which of them counts: they are only ``conflicting`` keys.
    """

    behavior: BehaviorReference | None = None
    hosted_class: HostedClass | None = None
    executable: Executable | None = None
    conflicting: tuple[Located[str], ...] = ()


def read_implementation(tree: Mapping, folders: SourceFolders) -> Implementation:
    """Return the implementation of a node type or an inline node."""
    written = (tree.entry("behavior"), tree.entry("class"), tree.entry("executable"))
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
        lifecycle=_lifecycle(tree.get("lifecycle")),
        ready_timeout_ms=number(tree.get("ready_timeout_ms")),
    )


def _reference(written: Located[str], folders: SourceFolders) -> BehaviorReference:
    folder = folders.folder(written.span)
    return BehaviorReference(written, folder, Project.at(folder).node_folders)


def _executable(entry: Entry, tree: Mapping, folder: Path) -> Executable:
    kind = choice(tree.get("kind"), ExecutableKind)
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
        kind=default.kind if kind is None else kind.value,
        lifecycle=_lifecycle(tree.get("lifecycle")),
        ready_timeout_ms=number(tree.get("ready_timeout_ms")),
        sigterm_timeout_ms=_milliseconds(
            tree.get("sigterm_timeout_ms"), default.sigterm_timeout_ms
        ),
        sigkill_timeout_ms=_milliseconds(
            tree.get("sigkill_timeout_ms"), default.sigkill_timeout_ms
        ),
        given=tuple(key(item) for item in tree),
    )


def _lifecycle(tree: Tree | None) -> LifecycleKind:
    written = choice(tree, LifecycleKind)
    return LifecycleKind.NONE if written is None else written.value


def _milliseconds(tree: Tree | None, default: float) -> float:
    written = number(tree)
    return default if written is None else written.value


def _words(tree: Tree | None) -> tuple[Located[str], ...]:
    items = getattr(tree, "items", ())
    return tuple(Located(word(item), item.span) for item in items if isinstance(item, Scalar))
