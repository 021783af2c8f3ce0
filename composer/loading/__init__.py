"""The static pipeline: from a file to its model and all of its diagnostics.

:func:`_resolve` and :func:`_check` call the stages in order. Each stage works on what the one
before it produced, even if that has errors, so that one run shows every diagnostic.
"""

from __future__ import annotations

import gc
from collections.abc import Collection, Iterable, Iterator, Sequence
from collections.abc import Mapping as Map
from contextlib import contextmanager
from dataclasses import field, replace
from functools import partial
from pathlib import Path

from composer.base.diagnostics import (
    Diagnostic,
    Severity,
    has_errors,
    in_order,
    registered_rules,
    shown,
)
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.interfaces import Interfaces
from composer.language.document import parse_bytes, read_document
from composer.language.document.limits import MAX_ENTRIES
from composer.language.expand import expand, missing_names
from composer.language.expand.arguments import read_declarations
from composer.language.rules import MISSING_VARIABLE, TOO_LARGE
from composer.language.schema import check_schema, kind_of, kinds
from composer.language.schema.kinds import check_kind
from composer.language.tree import Entry, LeftOut, Mapping, plain
from composer.language.tree import Sequence as ListTree
from composer.language.tree_values import word
from composer.loading.combinations import (
    Checked,
    argument_combinations,
    chosen_values,
    joined_diagnostics,
    places_of,
)
from composer.loading.reported import Identity, LoadResult, identity, may_be_included
from composer.model import System
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

    ``shown`` is the name of the file in diagnostics, ``overrides`` are words of a command line.
    Only the combination of arguments that these give is checked. Pass ``interfaces`` to load many
    files of one project: reading the interfaces takes most time.
    """
    parsed, diagnostics = read_overrides(overrides)
    definitions = _Definitions.of(_real_folder(path), interfaces)
    document = _read(path, shown)
    resolved = _resolve(document, definitions, parsed, diagnostics)
    [variant] = resolved.variants
    if not has_errors(variant.diagnostics):  # else a declaration may be wrong
        variant.diagnostics += _missing_arguments(document, parsed.arguments)
    return _check([resolved])[0]


@_without_cycle_collection()
def load_files(paths: Iterable[Path]) -> list[LoadResult]:
    """Load the files, with all combinations of arguments that they allow.

    Files of one project share its interfaces.
    """
    return _check(_resolve_files(paths, all_combinations=True))


@_without_cycle_collection()
def load_models(paths: Iterable[Path]) -> list[LoadResult]:
    """Load the files without checking them; ``diagnostics`` say what reading them found."""
    return [
        LoadResult(
            item.variants[0].system,
            item.variants[0].diagnostics,
            item.source,
            item.definitions.project,
            item.definitions.node_types,
            item.definitions.interfaces,
            item.variants[0].merged.tree,
        )
        for item in _resolve_files(paths)
    ]


def _resolve_files(paths: Iterable[Path], *, all_combinations: bool = False) -> list[_Resolved]:
    """Turn files into their models. Files of one project share its interfaces."""
    shared: dict[tuple[Path, ...], Interfaces] = {}
    by_folder: dict[Path, _Definitions] = {}
    resolved = []
    for path in paths:
        folder = _real_folder(path)
        if folder not in by_folder:
            by_folder[folder] = _Definitions.with_shared_interfaces(folder, shared)
        document = _read(path)
        resolved.append(_resolve(document, by_folder[folder], all_combinations=all_combinations))
    return resolved


@_without_cycle_collection()
def load_bytes(
    content: bytes, folder: Path, *, shown: str, interfaces: Interfaces | None = None
) -> LoadResult:
    """Load a text, such as standard input, as if it were the file ``shown`` in ``folder``.

    All combinations of arguments that it allows are checked.
    """
    document = _Document(*parse_bytes(content, shown))
    definitions = _Definitions.of(_real_folder(folder / shown), interfaces)
    return _check([_resolve(document, definitions, all_combinations=True)])[0]


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
    file name. ``is_partial`` is true if nodes may be missing. ``left_out`` are entries that
    conditions leave out.
    """

    tree: Mapping | None = None
    expanded: Mapping | None = None
    diagnostics: list[Diagnostic] = field(default_factory=list)
    folders: Map[str, Path] = field(default_factory=dict)
    included: Map[str, tuple[Span, ...]] = field(default_factory=dict)
    is_partial: bool = False
    left_out: tuple[LeftOut, ...] = ()


@dataclass(slots=True)
class _Variant:
    """A file with one combination of its arguments. ``context`` is None if there is no model.

    ``equal`` is a variant with the same tree: only that one is checked.
    """

    values: Map[str, str]
    merged: _Merged
    diagnostics: list[Diagnostic]
    context: Context | None = None
    equal: _Variant | None = None

    @property
    def system(self) -> System | None:
        """The model."""
        return None if self.context is None else self.context.system


@dataclass(slots=True)
class _Resolved:
    """A file with its models, before the rules.

    There is at least one variant: the first one has the given arguments and the defaults.
    """

    source: SourceFile
    definitions: _Definitions
    variants: list[_Variant]


def _resolve(
    document: _Document,
    definitions: _Definitions,
    overrides: Overrides | None = None,
    override_diagnostics: Iterable[Diagnostic] = (),
    *,
    all_combinations: bool = False,
) -> _Resolved:
    """Turn a file into its models: one, or one for each combination of its arguments."""
    given = overrides or Overrides()
    chosen: list[dict[str, Entry]] = [dict(given.arguments)]
    diagnostics = [*document.diagnostics, *override_diagnostics]
    is_system = document.tree is not None and kind_of(document.tree) == kinds.SYSTEM
    if all_combinations and is_system and document.tree is not None:
        chosen, problems = argument_combinations(document.tree, given.arguments)
        diagnostics += problems
    variants: list[_Variant] = []
    by_tree: dict[str, _Variant] = {}
    for arguments in chosen:
        # Kind, includes or inheritance, arguments, copies and conditions, schema.
        merged = _merge(document, definitions, arguments)
        values = chosen_values(document.tree, arguments) if document.tree and is_system else {}
        variant = _Variant(values, merged, [*diagnostics, *merged.diagnostics])
        variants.append(variant)
        if len(chosen) > 1:
            text = repr(merged.expanded and plain(merged.expanded))
            equal = by_tree.setdefault(text, variant)
            if equal is not variant:
                variant.equal = equal
                continue
        _resolve_model(variant, document.source, definitions, given)
    return _Resolved(document.source, definitions, variants)


def _resolve_model(
    variant: _Variant, source: SourceFile, definitions: _Definitions, overrides: Overrides
) -> None:
    """Add the model to a variant."""
    merged = variant.merged
    if merged.expanded is None:
        return
    system, found = resolve(
        merged.expanded,
        source,
        definitions.node_types,
        folders=merged.folders,
        overrides=overrides,
    )
    variant.diagnostics += found
    if system is not None:
        system = replace(system, left_out=merged.left_out)
        errors = tuple(
            item.primary
            for item in variant.diagnostics
            if item.severity is Severity.ERROR or item.rule is PARAMETER_SUBSTITUTION
        )
        variant.context = Context(
            system,
            definitions.interfaces,
            definitions.node_types,
            errors,
            is_partial=merged.is_partial,
        )


def _missing_arguments(document: _Document, given: Map[str, Entry]) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each argument of a system without a value."""
    tree = document.tree
    if tree is None or kind_of(tree) != kinds.SYSTEM:
        return
    declared = read_declarations(tree, kinds.SYSTEM) or {}
    for name in missing_names(tree, given):
        choices = " or ".join(f"{name}={word(item)}" for item in declared[name].alternatives)
        yield Diagnostic(
            MISSING_VARIABLE,
            f"argument '{shown(name)}' needs a value",
            declared[name].key.span,
            hint=f"add it to the command: {choices or f'{name}=VALUE'}",
        )


def _check(files: Sequence[_Resolved]) -> list[LoadResult]:
    """Check the models. The type checker runs over Python code while the rules are evaluated."""
    variants = [variant for item in files for variant in item.variants]
    types = TypeCheck.of([item.context for item in variants if item.context is not None])
    try:
        for variant in variants:
            if variant.context is not None:
                variant.diagnostics += run_checks(variant.context)
        checked = {_location(item) for item in files}
        return [_finish(item, types, checked) for item in files]
    finally:
        types.close()


def _location(file: _Resolved) -> Path:
    return file.definitions.folder / Path(file.source.path).name


def _finish(file: _Resolved, types: TypeCheck, checked: Collection[Path]) -> LoadResult:
    """Return what is reported of a file in the end; ``checked`` are all files of this run."""
    source, first = file.source, file.variants[0]
    project = file.definitions.project
    kept: set[Identity] = set()
    follow_ups: set[Identity] = set()
    for variant in file.variants:
        context = variant.context
        if context is not None:
            variant.diagnostics += reported(
                context, types.diagnostics(context, variant.diagnostics)
            )
            follow_ups.update(map(identity, variant.diagnostics))
            remaining = without_consequences(variant.diagnostics, project.diagnostics)
            variant.diagnostics = joined(deduplicate(remaining, context.system.nodes))
            kept.update(map(identity, variant.diagnostics))
    follow_ups -= kept
    diagnostics = joined_diagnostics(
        [
            Checked(
                item.values,
                (item.equal or item).diagnostics,
                _places(item, is_needed=len(file.variants) > 1),
            )
            for item in file.variants
        ]
    )

    # Selection: comments in the files and settings of the project silence diagnostics.
    included = {
        path: spans for item in file.variants for path, spans in item.merged.included.items()
    }
    diagnostics = add_include_labels(diagnostics, included)
    # Comments in a node type may be about rules that only apply to the systems that use it.
    is_complete = first.system is not None and not first.system.node_type
    selected, used = without_ignored(
        diagnostics,
        source,
        complete=is_complete,
        may_be_needed=partial(may_be_included, _location(file), project, checked),
    )
    follow_ups.update((UNUSED_IGNORE.code, str(comment)) for comment in used)
    all_checks()  # import every rule, so that all names in the settings are known
    selected = [
        *apply_rule_settings(selected, project.settings),
        *project.diagnostics,
        *check_rule_settings(project.settings, tuple(registered_rules())),
    ]
    return LoadResult(
        first.system,
        in_order(selected),
        source,
        project,
        file.definitions.node_types,
        file.definitions.interfaces,
        first.merged.tree,
        frozenset(follow_ups),
        tuple(item.system for item in file.variants[1:] if item.system is not None),
    )


def _places(variant: _Variant, *, is_needed: bool) -> frozenset[str]:
    tree = variant.merged.expanded if is_needed else None
    return frozenset() if tree is None else frozenset(places_of(tree))


def _merge(document: _Document, definitions: _Definitions, arguments: Map[str, Entry]) -> _Merged:
    tree = document.tree
    if not tree:
        return _Merged()
    match kind_of(tree):
        case kinds.SYSTEM if (surplus := _surplus_entry(tree)) is not None:
            return _Merged(diagnostics=[surplus])
        case kinds.SYSTEM:
            return _merge_system(tree, document.source, definitions, arguments)
        case kinds.NODE:
            return _merge_node_type(tree, document.source, definitions)
        case _:
            problem = check_kind(tree, document.source)
            return _Merged(diagnostics=[] if problem is None else [problem])


def _merge_system(
    tree: Mapping, source: SourceFile, definitions: _Definitions, arguments: Map[str, Entry]
) -> _Merged:
    # Each file is expanded and checked against the schema before it is merged.
    assembly = assemble(tree, source, definitions.folder, definitions.project, arguments)
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
        assembly.left_out,
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
    expanded, found, _ = expand(inherited.tree, {})
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
