"""The models of a file: one for each combination of its arguments, before the rules.

``compose validate`` checks each combination: both values of a bool, each of the ``choices``, and
the default of any other argument. The first combination has the defaults. Their diagnostics are
joined here as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from collections.abc import Mapping as Map
from dataclasses import field, replace
from functools import cached_property
from itertools import combinations, islice, product
from math import prod

from composer.base.diagnostics import Diagnostic, Severity, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.language.expand.arguments import Declared, read_declarations
from composer.language.rules import TOO_LARGE, UNUSED_DECLARATION
from composer.language.schema import SYSTEM, kind_of
from composer.language.tree import Entry, Scalar, Tree, plain, word
from composer.language.tree import Mapping as MapTree
from composer.language.tree import Sequence as ListTree
from composer.loading.merging import Definitions, Document, merge
from composer.loading.reported import Identity, identity
from composer.model import System
from composer.model.assembly import Merged
from composer.model.resolve import Overrides, resolve
from composer.model.resolve.parameter_files import PARAMETER_SUBSTITUTION
from composer.model.resolve.scenario import resolve_scenario
from composer.rules import Context
from composer.rules.connections import PUBLISHER_WITHOUT_SUBSCRIPTION
from composer.rules.parameters import UNMATCHED_PARAMETERS

MAX_COMBINATIONS = 64
#: Keys and values to read for all combinations together: of a large system, fewer are checked.
MAX_VALUES = 100_000
_MAX_NAMED = 3  # arguments in one message
#: Rules about a missing use. A use in any combination is a use.
_RULES_ABOUT_USES = frozenset(
    {UNUSED_DECLARATION.name, PUBLISHER_WITHOUT_SUBSCRIPTION.name, UNMATCHED_PARAMETERS.name}
)

#: Values of arguments by name; those without a value have their default.
Arguments = Mapping[str, Entry]


@dataclass(frozen=True, slots=True)
class Combinations:
    """The combinations of arguments to check, those with the fewest changes of defaults first.

    ``count`` is the number of all combinations that the system allows, ``values`` the number of
    other values than the defaults, and ``span`` the first argument that has several.
    """

    chosen: Sequence[Mapping[str, Entry]]
    count: int
    values: int
    span: Span | None

    def unchecked(self, checked: int) -> Iterator[Diagnostic]:
        """Yield what is not checked, if only the first ones were ``checked``."""
        if checked == self.count or self.span is None:
            return
        message = f"the arguments have {self.count:,} combinations"
        if self.count > MAX_COMBINATIONS and checked > self.values:
            message += (
                f", more than {MAX_COMBINATIONS}: each value is only checked with the defaults of"
                " the others"
            )
        else:
            message += f", too many for a system of this size: only {checked} of them are checked"
        yield Diagnostic(replace(TOO_LARGE, severity=Severity.INFO), message, self.span)


def argument_combinations(tree: MapTree, given: Arguments) -> Combinations:
    """Return the combinations of arguments, with those that are ``given`` in each.

    Of too many combinations, those in which one argument does not have its default are chosen.
    """
    declared = read_declarations(tree, SYSTEM) or {}
    names = [name for name, item in declared.items() if item.alternatives and name not in given]
    values = [_values(declared[name]) for name in names]
    count = prod(map(len, values))
    changes = len(names) if count <= MAX_COMBINATIONS else 1
    chosen = [
        {
            **given,
            **{
                name: Entry(declared[name].key, value)
                for name, value in zip(names, combination, strict=True)
                if value is not None
            },
        }
        for combination in islice(_with_changes(values, changes), MAX_COMBINATIONS)
    ]
    others = sum(len(choices) - 1 for choices in values)
    return Combinations(chosen, count, others, declared[names[0]].key.span if names else None)


def _values(declared: Declared) -> list[Scalar | None]:
    """Return the values of an argument; None for the default, which is first."""
    if declared.value is None:
        return [*declared.alternatives]
    return [None, *(item for item in declared.alternatives if item != declared.value)]


def _with_changes(
    values: Sequence[Sequence[Scalar | None]], most: int
) -> Iterator[list[Scalar | None]]:
    """Yield the combinations in which at most some arguments do not have their first value."""
    first = [choices[0] for choices in values]
    several = [index for index, choices in enumerate(values) if len(choices) > 1]
    for number in range(min(most, len(several)) + 1):
        for changed in combinations(several, number):
            for others in product(*(values[index][1:] for index in changed)):
                combination = list(first)
                for index, value in zip(changed, others, strict=True):
                    combination[index] = value
                yield combination


def chosen_values(tree: MapTree, arguments: Arguments) -> dict[str, str]:
    """Return the values of all arguments with alternatives, as a command line has them."""
    declared = read_declarations(tree, SYSTEM) or {}
    found: dict[str, str] = {}
    for name, item in declared.items():
        value = arguments[name].value if name in arguments else item.value
        if item.alternatives and isinstance(value, Scalar):
            found[name] = word(value)
    return found


def places_of(tree: Tree) -> Iterator[str]:
    """Yield the place of every key and value."""
    yield str(tree.span)
    match tree:
        case MapTree():
            for entry in tree:
                yield str(entry.key.span)
                yield from places_of(entry.value)
        case ListTree():
            for item in tree.items:
                yield from places_of(item)


def joined_diagnostics(checked: Sequence[Variant]) -> list[Diagnostic]:
    """Return the diagnostics of all combinations, each once.

    A diagnostic that the first combination does not have names the arguments with which it appears.
    """
    having: dict[Identity, list[int]] = {}
    samples: dict[Identity, list[Diagnostic]] = {}
    for number, item in enumerate(checked):
        for diagnostic in (item.equal or item).diagnostics:
            key = identity(diagnostic)
            numbers = having.setdefault(key, [])
            if not numbers or numbers[-1] != number:
                numbers.append(number)
            if numbers[0] == number:
                samples.setdefault(key, []).append(diagnostic)
    return [
        _named(diagnostic, checked, having[key])
        for key, diagnostics in samples.items()
        for diagnostic in diagnostics
        if not _is_used(diagnostic, checked, having[key])
    ]


def _is_used(diagnostic: Diagnostic, checked: Sequence[Variant], having: Sequence[int]) -> bool:
    """Return whether a declaration without a use in some combinations has one in another."""
    if diagnostic.rule.name not in _RULES_ABOUT_USES:
        return False
    place = str(diagnostic.primary)
    is_in_tree = any(place in item.places for item in checked)
    return any(
        number not in having and (not is_in_tree or place in item.places)
        for number, item in enumerate(checked)
    )


def _named(diagnostic: Diagnostic, checked: Sequence[Variant], having: Sequence[int]) -> Diagnostic:
    if having[0] == 0:
        return diagnostic
    has = set(having)
    sample = checked[having[0]].values

    def implies(names: Iterable[str]) -> bool:
        chosen = {name: sample[name] for name in names}
        return all(
            number in has
            for number, item in enumerate(checked)
            if all(item.values.get(name) == value for name, value in chosen.items())
        )

    varying = (name for name in sample if len({item.values.get(name) for item in checked}) > 1)
    names = _smallest(tuple(varying), implies)
    text = ", ".join(f"{shown(name)}={shown(sample[name])}" for name in names)
    return replace(diagnostic, message=f"{diagnostic.message} (with {text})")


def _smallest(names: tuple[str, ...], implies: Callable[[Iterable[str]], bool]) -> tuple[str, ...]:
    """Return the fewest names that suffice; all names if more than a few are needed."""
    for count in range(1, _MAX_NAMED + 1):
        for chosen in combinations(names, count):
            if implies(chosen):
                return chosen
    return names


@dataclass(eq=False)
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

    @cached_property
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
    if tree is None or not all_combinations or kind_of(tree) != SYSTEM:
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
