"""The types of what functions give that iterate over their arguments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import GeneratorType

from composer.behavior_types.scalars import is_text
from composer.behavior_types.values import Collection, Value, join, join_all, pair
from composer.field_types import ANYTHING, INTEGER, STRING
from composer.interfaces import FieldType

_PAIR = 2
#: Functions that iterate over each of their arguments.
ITERATING = frozenset(
    {"enumerate", "filter", "frozenset", "iter", "itertools.chain", "itertools.dropwhile"}
    | {"itertools.groupby", "itertools.islice", "itertools.pairwise", "itertools.takewhile"}
    | {"list", "set", "sorted", "sum", "tuple", "zip"}
)


def element_of(type_: Value) -> Value:
    """Return the type of what iterating over a value gives, as it is written in its type."""
    if isinstance(type_, Collection):
        return type_.key if issubclass(type_.python, Mapping) else type_.element
    if isinstance(type_, FieldType) and type_.is_array:
        return type_.element
    return STRING if is_text(type_) else ANYTHING


def _enumerate(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return Collection(enumerate, pair(INTEGER, element_of(arguments[0]))) if arguments else ANYTHING


def _zip(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return Collection(zip, pair(*map(element_of, arguments))) if arguments else ANYTHING


def _pairwise(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    element = element_of(arguments[0]) if arguments else ANYTHING
    return Collection(GeneratorType, pair(element, element))


def _chain(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return Collection(GeneratorType, join_all(map(element_of, arguments)))


def _part(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    """Return the type of a call of ``islice``, which gives elements of its first argument."""
    return Collection(GeneratorType, element_of(arguments[0]) if arguments else ANYTHING)


def _chosen(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    """Return the type of a call of ``takewhile`` or ``dropwhile``."""
    is_known = len(arguments) == _PAIR
    return Collection(GeneratorType, element_of(arguments[1]) if is_known else ANYTHING)


def _groups(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    """Return the type of a call of ``groupby``: keys, each with an iterator over elements."""
    element = element_of(arguments[0]) if arguments else ANYTHING
    return Collection(GeneratorType, pair(ANYTHING, Collection(GeneratorType, element)))


def _next(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    found = element_of(arguments[0]) if arguments else ANYTHING
    return join(found, arguments[1]) if len(arguments) > 1 else found


def _filter(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return Collection(filter, element_of(arguments[1])) if len(arguments) == _PAIR else ANYTHING


def _map(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return Collection(map) if arguments else ANYTHING


#: By name.
OF_ITERABLES: Mapping[str, Callable[[Sequence[Value], Mapping[str, Value]], Value]] = {
    "enumerate": _enumerate,
    "filter": _filter,
    "itertools.chain": _chain,
    "itertools.dropwhile": _chosen,
    "itertools.groupby": _groups,
    "itertools.islice": _part,
    "itertools.pairwise": _pairwise,
    "itertools.takewhile": _chosen,
    "map": _map,
    "next": _next,
    "zip": _zip,
}
