"""The combinations of arguments that a system allows, and the diagnostics of all of them together.

``compose validate`` checks each combination: both values of a bool, each of the ``choices``, and
the default of any other argument. The first combination has the defaults.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product
from math import prod

from composer.base.diagnostics import Diagnostic, Severity, shown
from composer.base.fast_dataclass import dataclass
from composer.language.expand.arguments import Declared, read_declarations
from composer.language.rules import TOO_LARGE, UNUSED_DECLARATION
from composer.language.schema.kinds import SYSTEM
from composer.language.tree import Entry, Scalar, Tree
from composer.language.tree import Mapping as MapTree
from composer.language.tree import Sequence as ListTree
from composer.language.tree_values import word
from composer.loading.reported import Identity, identity
from composer.rules.connections import PUBLISHER_WITHOUT_SUBSCRIPTION
from composer.rules.parameters import UNMATCHED_PARAMETERS

MAX_COMBINATIONS = 64
_MAX_NAMED = 3  # arguments in one message
#: Rules about a missing use. A use in any combination is a use.
_RULES_ABOUT_USES = frozenset(
    {UNUSED_DECLARATION.name, PUBLISHER_WITHOUT_SUBSCRIPTION.name, UNMATCHED_PARAMETERS.name}
)

#: Values of arguments by name; those without a value have their default.
Arguments = Mapping[str, Entry]


def argument_combinations(
    tree: MapTree, given: Arguments
) -> tuple[list[dict[str, Entry]], list[Diagnostic]]:
    """Return the combinations of arguments to check, with those that are ``given`` in each.

    Of too many combinations, each value is in one of those returned, and a diagnostic says so.
    """
    declared = read_declarations(tree, SYSTEM) or {}
    open_names = [
        name for name, item in declared.items() if item.alternatives and name not in given
    ]
    values = [_values(declared[name]) for name in open_names]
    count = prod(map(len, values))
    if count <= MAX_COMBINATIONS:
        chosen: Iterable[Sequence[Scalar | None]] = product(*values)
        problems = []
    else:
        chosen = _each_value_once(values)
        message = (
            f"the arguments have {count:,} combinations, more than {MAX_COMBINATIONS}: each value"
            " is only checked with the defaults of the others"
        )
        span = declared[open_names[0]].key.span
        problems = [Diagnostic(replace(TOO_LARGE, severity=Severity.INFO), message, span)]
    return [
        {
            **given,
            **{
                name: Entry(declared[name].key, value)
                for name, value in zip(open_names, combination, strict=True)
                if value is not None
            },
        }
        for combination in chosen
    ], problems


def _values(declared: Declared) -> list[Scalar | None]:
    """Return the values of an argument; None for the default, which is first."""
    if declared.value is None:
        return [*declared.alternatives]
    return [None, *(item for item in declared.alternatives if item != declared.value)]


def _each_value_once(values: Sequence[Sequence[Scalar | None]]) -> Iterator[list[Scalar | None]]:
    first = [choices[0] for choices in values]
    yield first
    for index, choices in enumerate(values):
        for value in choices[1:]:
            yield [*first[:index], value, *first[index + 1 :]]


def chosen_values(tree: MapTree, arguments: Arguments) -> dict[str, str]:
    """Return the values of all arguments with alternatives, as a command line has them."""
    declared = read_declarations(tree, SYSTEM) or {}
    found: dict[str, str] = {}
    for name, item in declared.items():
        value = arguments[name].value if name in arguments else item.value
        if item.alternatives and isinstance(value, Scalar):
            found[name] = word(value)
    return found


@dataclass(frozen=True, slots=True)
class Checked:
    """What is reported with one combination of arguments, ``values``.

    ``places`` are those of all keys and values of the system.
    """

    values: Mapping[str, str]
    diagnostics: Sequence[Diagnostic]
    places: frozenset[str] = frozenset()


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


def joined_diagnostics(checked: Sequence[Checked]) -> list[Diagnostic]:
    """Return the diagnostics of all combinations, each once.

    A diagnostic that the first combination does not have names the arguments with which it appears.
    """
    first, *others = checked
    if not others:
        return list(first.diagnostics)
    having: dict[Identity, list[int]] = {}
    samples: dict[Identity, list[Diagnostic]] = {}
    for number, item in enumerate(checked):
        for diagnostic in item.diagnostics:
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


def _is_used(diagnostic: Diagnostic, checked: Sequence[Checked], having: Sequence[int]) -> bool:
    """Return whether a declaration without a use in some combinations has one in another."""
    if diagnostic.rule.name not in _RULES_ABOUT_USES:
        return False
    place = str(diagnostic.primary)
    is_in_tree = any(place in item.places for item in checked)
    return any(
        number not in having and (not is_in_tree or place in item.places)
        for number, item in enumerate(checked)
    )


def _named(diagnostic: Diagnostic, checked: Sequence[Checked], having: Sequence[int]) -> Diagnostic:
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

    names = _smallest(tuple(sample), implies)
    text = ", ".join(f"{shown(name)}={shown(sample[name])}" for name in names)
    return replace(diagnostic, message=f"{diagnostic.message} (with {text})")


def _smallest(names: tuple[str, ...], implies: Callable[[Iterable[str]], bool]) -> tuple[str, ...]:
    """Return the fewest names that suffice; all names if more than a few are needed."""
    for count in range(1, _MAX_NAMED + 1):
        for chosen in combinations(names, count):
            if implies(chosen):
                return chosen
    return names
