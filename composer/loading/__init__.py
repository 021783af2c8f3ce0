"""The static pipeline: from a file to its model and all of its diagnostics.

:func:`~composer.loading.variants.resolve_file` and :func:`_check` call the stages in order. Each
stage works on what the one before it produced, even if that has errors, so that one run shows every
diagnostic.
"""

from __future__ import annotations

import gc
from collections.abc import Collection, Iterable, Iterator, Sequence
from collections.abc import Mapping as Map
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from composer.base.diagnostics import Diagnostic, has_errors, in_order, registered_rules, shown
from composer.interfaces import Interfaces
from composer.language.document import parse_bytes
from composer.language.expand import missing_names
from composer.language.expand.arguments import read_declarations
from composer.language.rules import MISSING_VARIABLE
from composer.language.schema import SYSTEM, kind_of
from composer.language.tree import Entry, word
from composer.loading.merging import Definitions, Document, read, real_folder
from composer.loading.reported import (
    Identity,
    LoadResult,
    add_include_labels,
    deduplicate,
    identity,
    may_be_included,
)
from composer.loading.variants import Resolved, joined_diagnostics, resolve_file
from composer.model.resolve import NO_OVERRIDES, OverrideOptions, read_overrides
from composer.project.settings import apply_rule_settings, check_rule_settings
from composer.rules import all_checks, reported, run_checks
from composer.rules.analysis.subjects import joined, without_consequences
from composer.rules.ignore_comments import UNUSED_IGNORE, without_ignored
from composer.rules.python import TypeCheck


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
    needs_values: bool = True,
) -> LoadResult:
    """Read, resolve and check the system or node type in the file ``path``.

    ``shown`` is the name of the file in diagnostics, ``overrides`` are words of a command line.
    Only the combination of arguments that these give is checked; if it ``needs_values``, each
    argument must have one. Pass ``interfaces`` to load many files of one project: reading the
    interfaces takes most time.
    """
    parsed, diagnostics = read_overrides(overrides)
    definitions = Definitions.of(real_folder(path), interfaces)
    document = read(path, shown)
    resolved = resolve_file(document, definitions, parsed, diagnostics)
    [variant] = resolved.variants
    if needs_values and not has_errors(variant.diagnostics):  # else a declaration may be wrong
        variant.diagnostics += _missing_arguments(document, parsed.arguments)
    return _check([resolved])[0]


@_without_cycle_collection()
def load_files(
    paths: Iterable[Path], overrides: OverrideOptions = NO_OVERRIDES
) -> list[LoadResult]:
    """Load the files, with all combinations of the arguments that ``overrides`` leave open.

    Files of one project share its interfaces.
    """
    return _check(_resolve_files(paths, overrides, all_combinations=True))


@_without_cycle_collection()
def load_models(
    paths: Iterable[Path], overrides: OverrideOptions = NO_OVERRIDES
) -> list[LoadResult]:
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
        for item in _resolve_files(paths, overrides)
    ]


def _resolve_files(
    paths: Iterable[Path],
    options: OverrideOptions = NO_OVERRIDES,
    *,
    all_combinations: bool = False,
) -> list[Resolved]:
    """Turn files into their models. Files of one project share its interfaces."""
    overrides, diagnostics = read_overrides(options)
    shared: dict[tuple[Path, ...], Interfaces] = {}
    by_folder: dict[Path, Definitions] = {}
    resolved = []
    for path in paths:
        folder = real_folder(path)
        if folder not in by_folder:
            by_folder[folder] = Definitions.with_shared_interfaces(folder, shared)
        document = read(path)
        resolved.append(
            resolve_file(
                document,
                by_folder[folder],
                overrides,
                diagnostics,
                all_combinations=all_combinations,
            )
        )
    return resolved


@_without_cycle_collection()
def load_bytes(
    content: bytes,
    folder: Path,
    *,
    shown: str,
    overrides: OverrideOptions = NO_OVERRIDES,
    interfaces: Interfaces | None = None,
) -> LoadResult:
    """Load a text, such as standard input, as if it were the file ``shown`` in ``folder``.

    All combinations of the arguments that ``overrides`` leave open are checked.
    """
    given, diagnostics = read_overrides(overrides)
    document = Document(*parse_bytes(content, shown))
    definitions = Definitions.of(real_folder(folder / shown), interfaces)
    resolved = resolve_file(document, definitions, given, diagnostics, all_combinations=True)
    return _check([resolved])[0]


def _missing_arguments(document: Document, given: Map[str, Entry]) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each argument of a system without a value."""
    tree = document.tree
    if tree is None or kind_of(tree) != SYSTEM:
        return
    declared = read_declarations(tree, SYSTEM) or {}
    for name in missing_names(tree, given):
        choices = " or ".join(f"{name}={word(item)}" for item in declared[name].alternatives)
        yield Diagnostic(
            MISSING_VARIABLE,
            f"argument '{shown(name)}' needs a value",
            declared[name].key.span,
            hint=f"add it to the command: {choices or f'{name}=VALUE'}",
        )


def _check(files: Sequence[Resolved]) -> list[LoadResult]:
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


def _location(file: Resolved) -> Path:
    return file.definitions.folder / Path(file.source.path).name


def _finish(file: Resolved, types: TypeCheck, checked: Collection[Path]) -> LoadResult:
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
    diagnostics = first.diagnostics
    if len(file.variants) > 1:
        diagnostics = joined_diagnostics(file.variants)

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
    scenario = None if first.context is None else first.context.scenario
    system = first.system
    if system is not None and scenario is not None:
        system = system.without_nodes(scenario.replaced)
    selected = [
        *apply_rule_settings(selected, project.settings),
        *project.diagnostics,
        *check_rule_settings(project.settings, tuple(registered_rules())),
    ]
    return LoadResult(
        system,
        in_order(selected),
        source,
        project,
        file.definitions.node_types,
        file.definitions.interfaces,
        first.merged.tree,
        frozenset(follow_ups),
        tuple(item.system for item in file.variants[1:] if item.system is not None),
        scenario,
    )


def gives_same_model(result: LoadResult, text: str) -> bool:
    """Return whether ``text``, in place of the loaded file, gives the same model."""
    again = load_bytes(
        text.encode(), Path.cwd(), shown=result.source.path, interfaces=result.interfaces
    )
    return again.system == result.system
