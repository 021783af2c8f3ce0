"""The models of a file: one for each combination of its arguments, before the rules."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Map
from dataclasses import field, replace

from composer.base.diagnostics import Diagnostic, Severity
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile
from composer.language.schema import kind_of, kinds
from composer.language.tree import Entry, plain
from composer.loading.combinations import (
    MAX_VALUES,
    argument_combinations,
    chosen_values,
    places_of,
)
from composer.loading.merging import Definitions, Document, Merged, merge
from composer.model import System
from composer.model.resolve import Overrides, resolve
from composer.model.resolve.parameter_files import PARAMETER_SUBSTITUTION
from composer.model.resolve.scenario import resolve_scenario
from composer.rules import Context


@dataclass(slots=True)
class Variant:
    """A file with one combination of its arguments. ``context`` is None if there is no model.

    ``equal`` is a variant with the same tree: only that one is checked. ``values`` are the values
    of the arguments, if there are several combinations.
    """

    merged: Merged
    diagnostics: list[Diagnostic]
    context: Context | None = None
    equal: Variant | None = None
    values: Map[str, str] = field(default_factory=dict)

    @property
    def system(self) -> System | None:
        """The model."""
        return None if self.context is None else self.context.system

    @property
    def places(self) -> frozenset[str]:
        """The places of all keys and values."""
        tree = self.merged.expanded
        return frozenset() if tree is None else frozenset(places_of(tree))


@dataclass(slots=True)
class Resolved:
    """A file with its models, before the rules.

    There is at least one variant: the first one has the given arguments and the defaults.
    """

    source: SourceFile
    definitions: Definitions
    variants: list[Variant]


def resolve_file(
    document: Document,
    definitions: Definitions,
    overrides: Overrides | None = None,
    override_diagnostics: Iterable[Diagnostic] = (),
    *,
    all_combinations: bool = False,
) -> Resolved:
    """Turn a file into its models: one, or one for each combination of its arguments."""
    given = overrides or Overrides()
    diagnostics = [*document.diagnostics, *override_diagnostics]
    tree = document.tree
    if tree is None or not all_combinations or kind_of(tree) != kinds.SYSTEM:
        variant = _merged(document, definitions, given.arguments, diagnostics)
        _add_model(variant, document.source, definitions, given)
        return Resolved(document.source, definitions, [variant])
    combinations = argument_combinations(tree, given.arguments)
    variants: list[Variant] = []
    by_tree: dict[str, Variant] = {}
    values = 0
    for arguments in combinations.chosen:
        variant = _merged(document, definitions, arguments, diagnostics)
        variants.append(variant)
        if combinations.count > 1:
            variant.values = chosen_values(tree, arguments)
            text = repr(variant.merged.expanded and plain(variant.merged.expanded))
            equal = by_tree.setdefault(text, variant)
            if equal is not variant:
                variant.equal = equal
        if variant.equal is None:
            _add_model(variant, document.source, definitions, given)
        values += variant.merged.values
        if values > MAX_VALUES:
            break
    variants[0].diagnostics += combinations.unchecked(len(variants))
    return Resolved(document.source, definitions, variants)


def _merged(
    document: Document,
    definitions: Definitions,
    arguments: Map[str, Entry],
    diagnostics: Iterable[Diagnostic],
) -> Variant:
    # Kind, includes or inheritance, arguments, copies and conditions, schema.
    merged = merge(document, definitions, arguments)
    return Variant(merged, [*diagnostics, *merged.diagnostics])


def _add_model(
    variant: Variant, source: SourceFile, definitions: Definitions, overrides: Overrides
) -> None:
    """Add the model to a variant."""
    merged = variant.merged
    if merged.expanded is None:
        return
    system, found = resolve(
        merged.expanded,
        merged.source or source,
        definitions.node_types,
        folders=merged.folders,
        overrides=overrides,
    )
    variant.diagnostics += found
    if system is not None:
        scenario = None
        if merged.scenario is not None:
            scenario, found = resolve_scenario(merged.scenario, source, system, definitions.folder)
            variant.diagnostics += found
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
            scenario=scenario,
        )
