"""The static pipeline: from a file to its model and all of its diagnostics.

:func:`_resolve` and :func:`_check` call the stages in order. Each stage works on what the one
before it produced, even if that has errors, so that one run shows every diagnostic.
"""

from __future__ import annotations

import gc
from collections.abc import Collection, Iterable, Iterator, Sequence
from collections.abc import Mapping as Map
from contextlib import contextmanager
from dataclasses import field
from functools import partial
from pathlib import Path

from composer.base.diagnostics import (
    Diagnostic,
    Severity,
    in_order,
    registered_rules,
    shown,
)
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.interfaces import Interfaces
from composer.language.document import parse_bytes, read_document
from composer.language.document.limits import MAX_ENTRIES
from composer.language.expand import expand
from composer.language.rules import TOO_LARGE
from composer.language.schema import check_schema, kind_of, kinds
from composer.language.schema.kinds import check_kind
from composer.language.tree import Mapping
from composer.language.tree import Sequence as ListTree
from composer.loading.reported import Identity, LoadResult, identity, may_be_included
from composer.model.assembly import NodeTypeFile, assemble, inherit
from composer.model.assembly.deduplication import add_include_labels, deduplicate
from composer.model.resolve import NO_OVERRIDES, OverrideOptions, Overrides, read_overrides, resolve
from composer.model.resolve.parameter_files import PARAMETER_SUBSTITUTION
from composer.project import SETTINGS_FILE, Project
from composer.project.node_types import NodeTypes, interface_folders
from composer.project.settings import apply_rule_settings, check_rule_settings
from composer.rules import Context, all_checks, reported, run_checks
from composer.rules.analysis.subjects import joined, without_consequences
from composer.rules.ignore_comments import UNUSED_IGNORE, without_ignored
from composer.rules.type_check import TypeCheck


@contextmanager
def _without_cycle_collection() -> Iterator[None]:
    """Pause Python's search for reference cycles, which takes half of the time of a large system.

    It visits all objects again and again as their number grows; trees and models have no cycles.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@_without_cycle_collection()
def load(
    path: Path,
    *,
    shown: str | None = None,
    overrides: OverrideOptions = NO_OVERRIDES,
    interfaces: Interfaces | None = None,
) -> LoadResult:
    """Read, resolve and check the system or node type in the file ``path``.

    ``shown`` is the name of the file in diagnostics, ``overrides`` are options of a command line.
    Pass ``interfaces`` to load many files of one project: reading the interfaces takes most time.
    """
    parsed, diagnostics = read_overrides(overrides)
    definitions = _Definitions.of(_real_folder(path), interfaces)
    return _check([_resolve(_read(path, shown), definitions, parsed, diagnostics)])[0]


@_without_cycle_collection()
def load_files(paths: Iterable[Path]) -> list[LoadResult]:
    """Load the files. Files of one project share its interfaces."""
    return _check(_resolve_files(paths))


@_without_cycle_collection()
def load_models(paths: Iterable[Path]) -> list[LoadResult]:
    """Load the files without checking them; ``diagnostics`` say what reading them found."""
    return [
        LoadResult(
            None if item.context is None else item.context.system,
            item.diagnostics,
            item.source,
            item.definitions.project,
            item.definitions.node_types,
            item.definitions.interfaces,
            item.merged.tree,
        )
        for item in _resolve_files(paths)
    ]


def _resolve_files(paths: Iterable[Path]) -> list[_Resolved]:
    """Turn files into their models. Files of one project share its interfaces."""
    shared: dict[tuple[Path, ...], Interfaces] = {}
    by_folder: dict[Path, _Definitions] = {}
    resolved = []
    for path in paths:
        folder = _real_folder(path)
        if folder not in by_folder:
            by_folder[folder] = _Definitions.with_shared_interfaces(folder, shared)
        resolved.append(_resolve(_read(path), by_folder[folder]))
    return resolved


@_without_cycle_collection()
def load_bytes(
    content: bytes, folder: Path, *, shown: str, interfaces: Interfaces | None = None
) -> LoadResult:
    """Load a text, such as standard input, as if it were the file ``shown`` in ``folder``."""
    document = _Document(*parse_bytes(content, shown))
    definitions = _Definitions.of(_real_folder(folder / shown), interfaces)
    return _check([_resolve(document, definitions)])[0]


@dataclass(frozen=True, slots=True)
class _Document:
    """A file as a located tree."""

    tree: Mapping | None
    source: SourceFile
    diagnostics: list[Diagnostic]


@dataclass(frozen=True, slots=True)
class _Definitions:
    """The node types and interfaces that files in ``folder`` may refer to."""

    folder: Path
    project: Project
    node_types: NodeTypes
    interfaces: Interfaces

    @classmethod
    def of(cls, folder: Path, interfaces: Interfaces | None) -> _Definitions:
        project = Project.at(folder)
        if interfaces is None:
            interfaces = Interfaces.load(interface_folders(project))
        return cls(folder, project, NodeTypes.of(project), interfaces)

    @classmethod
    def with_shared_interfaces(
        cls, folder: Path, shared: dict[tuple[Path, ...], Interfaces]
    ) -> _Definitions:
        """Return the definitions, with interfaces that other folders of the project share."""
        project = Project.at(folder)
        folders = interface_folders(project)
        if folders not in shared:
            shared[folders] = Interfaces.load(folders)
        return cls(folder, project, NodeTypes.of(project), shared[folders])


@dataclass(frozen=True, slots=True)
class _Merged:
    """A file merged with what it includes or extends.

    ``tree`` is what ``compose config`` shows, ``expanded`` has values in place of variables.
    ``folders`` and ``included`` are the folders of all files and the places that include them, by
    file name. ``is_partial`` is true if nodes may be missing.
    """

    tree: Mapping | None = None
    expanded: Mapping | None = None
    diagnostics: list[Diagnostic] = field(default_factory=list)
    folders: Map[str, Path] = field(default_factory=dict)
    included: Map[str, tuple[Span, ...]] = field(default_factory=dict)
    is_partial: bool = False


@dataclass(slots=True)
class _Resolved:
    """A file with its model, before the rules. ``context`` is None if there is no model."""

    source: SourceFile
    definitions: _Definitions
    merged: _Merged
    diagnostics: list[Diagnostic]
    context: Context | None = None


def _resolve(
    document: _Document,
    definitions: _Definitions,
    overrides: Overrides | None = None,
    override_diagnostics: Iterable[Diagnostic] = (),
) -> _Resolved:
    """Turn a file into its model."""
    # Kind, includes or inheritance, variables and copies, schema.
    merged = _merge(document, definitions)
    diagnostics = [*document.diagnostics, *override_diagnostics, *merged.diagnostics]
    resolved = _Resolved(document.source, definitions, merged, diagnostics)
    if merged.expanded is None:
        return resolved
    system, found = resolve(
        merged.expanded,
        document.source,
        definitions.node_types,
        folders=merged.folders,
        overrides=overrides or Overrides(),
    )
    diagnostics += found
    if system is not None:
        errors = tuple(
            item.primary
            for item in diagnostics
            if item.severity is Severity.ERROR or item.rule is PARAMETER_SUBSTITUTION
        )
        resolved.context = Context(
            system,
            definitions.interfaces,
            definitions.node_types,
            errors,
            is_partial=merged.is_partial,
        )
    return resolved


def _check(files: Sequence[_Resolved]) -> list[LoadResult]:
    """Check the models. The type checker runs over Python code while the rules are evaluated."""
    contexts = [item.context for item in files if item.context is not None]
    types = TypeCheck.of(contexts)
    try:
        for item in files:
            if item.context is not None:
                item.diagnostics += run_checks(item.context)
        checked = {_location(item) for item in files}
        return [_finish(item, types, checked) for item in files]
    finally:
        types.close()


def _location(file: _Resolved) -> Path:
    return file.definitions.folder / Path(file.source.path).name


def _finish(file: _Resolved, types: TypeCheck, checked: Collection[Path]) -> LoadResult:
    """Return what is reported of a file in the end; ``checked`` are all files of this run."""
    source, context = file.source, file.context
    project = file.definitions.project
    diagnostics = file.diagnostics
    follow_ups: frozenset[Identity] = frozenset()
    if context is not None:
        diagnostics += reported(context, types.diagnostics(context, diagnostics))
        kept = without_consequences(diagnostics, project.diagnostics)
        kept = joined(deduplicate(kept, context.system.nodes))
        follow_ups = frozenset(map(identity, diagnostics)).difference(map(identity, kept))
        diagnostics = kept

    # Selection: comments in the files and settings of the project silence diagnostics.
    diagnostics = add_include_labels(diagnostics, file.merged.included)
    # Comments in a node type may be about rules that only apply to the systems that use it.
    is_complete = context is not None and not context.system.node_type
    kept, used = without_ignored(
        diagnostics,
        source,
        complete=is_complete,
        may_be_needed=partial(may_be_included, _location(file), project, checked),
    )
    follow_ups |= {(UNUSED_IGNORE.code, str(comment)) for comment in used}
    all_checks()  # import every rule, so that all names in the settings are known
    selected = [
        *apply_rule_settings(kept, project.settings),
        *project.diagnostics,
        *check_rule_settings(project.settings, tuple(registered_rules())),
    ]
    return LoadResult(
        None if context is None else context.system,
        in_order(selected),
        source,
        project,
        file.definitions.node_types,
        file.definitions.interfaces,
        file.merged.tree,
        follow_ups,
    )


def _merge(document: _Document, definitions: _Definitions) -> _Merged:
    tree = document.tree
    if not tree:
        return _Merged()
    match kind_of(tree):
        case kinds.SYSTEM if (surplus := _surplus_entry(tree)) is not None:
            return _Merged(diagnostics=[surplus])
        case kinds.SYSTEM:
            return _merge_system(tree, document.source, definitions)
        case kinds.NODE:
            return _merge_node_type(tree, document.source, definitions)
        case _:
            problem = check_kind(tree, document.source)
            return _Merged(diagnostics=[] if problem is None else [problem])


def _merge_system(tree: Mapping, source: SourceFile, definitions: _Definitions) -> _Merged:
    # Each file is expanded and checked against the schema before it is merged.
    assembly = assemble(tree, source, definitions.folder, definitions.project)
    surplus = None if assembly.tree is None else _surplus_entry(assembly.tree)
    if surplus is not None:
        return _Merged(diagnostics=[*assembly.diagnostics, surplus])
    return _Merged(
        assembly.tree,
        assembly.tree,
        assembly.diagnostics,
        assembly.folders,
        assembly.included,
        assembly.is_partial,
    )


def _surplus_entry(tree: Mapping) -> Diagnostic | None:
    """Return the diagnostic for a section with too many entries."""
    for section in tree:
        match section.value:
            case Mapping(entries=entries) if len(entries) > MAX_ENTRIES:
                span = entries[MAX_ENTRIES].key.span
            case ListTree(items=items) if len(items) > MAX_ENTRIES:
                span = items[MAX_ENTRIES].span
            case _:
                continue
        message = f"'{shown(section.name)}' has more than {MAX_ENTRIES:,} entries"
        return Diagnostic(TOO_LARGE, message, span)
    return None


def _merge_node_type(tree: Mapping, source: SourceFile, definitions: _Definitions) -> _Merged:
    file = NodeTypeFile(definitions.folder / Path(source.path).name, source, tree)
    inherited = inherit(file)
    if inherited.tree is None:
        return _Merged(diagnostics=inherited.diagnostics)
    expanded, found = expand(inherited.tree, {})
    diagnostics = [*inherited.diagnostics, *found, *check_schema(expanded, kinds.NODE)]
    return _Merged(inherited.tree, expanded, diagnostics, inherited.folders)


def _read(path: Path, shown: str | None = None) -> _Document:
    tree, source, diagnostics = read_document(path, shown)
    if path.name == SETTINGS_FILE:  # its diagnostics are those of the project
        tree, diagnostics = None, []
    return _Document(tree, source, diagnostics)


def _real_folder(path: Path) -> Path:
    """Return the folder of a file; of a symbolic link, the folder of its target."""
    try:
        return path.resolve().parent
    except (OSError, RuntimeError, ValueError):  # reported when the file is read
        return Path.cwd()


def gives_same_model(result: LoadResult, text: str) -> bool:
    """Return whether ``text``, in place of the loaded file, gives the same model."""
    again = load_bytes(
        text.encode(), Path.cwd(), shown=result.source.path, interfaces=result.interfaces
    )
    return again.system == result.system
