"""The types of what built-in functions, the standard library and methods of Python return."""

from __future__ import annotations

import builtins
import importlib
import itertools
import re
from collections import Counter, deque
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from types import AsyncGeneratorType, GeneratorType

from composer import behavior
from composer.behavior_types.libraries.iterables import OF_ITERABLES, element_of
from composer.behavior_types.libraries.numpy_types import ARRAY, numpy_method_result, numpy_result
from composer.behavior_types.scalars import is_float, is_integer, is_number, is_text
from composer.behavior_types.values import (
    NONE,
    BuiltinObject,
    Collection,
    Value,
    join,
    join_all,
    pair,
)
from composer.field_types import ANYTHING, BOOL, INTEGER, NUMBER, STRING
from composer.interfaces import FieldType

_NO_ITEMS: dict[str, str] = {}
_VALUES, _KEYS, _ITEMS = (
    type(_NO_ITEMS.values()),
    type(_NO_ITEMS.keys()),
    type(_NO_ITEMS.items()),
)
#: What can be iterated over once only, and has no length.
ITERATORS = frozenset({GeneratorType, enumerate, filter, map, reversed, zip, itertools.cycle})
#: What messages do not accept as an array.
NO_SEQUENCES = ITERATORS | {dict, Counter, _VALUES, _ITEMS}

_MATH_TO_INTEGER = frozenset({"ceil", "comb", "factorial", "floor", "gcd", "isqrt", "lcm", "trunc"})
_MATH_TO_BOOL = frozenset({"isclose", "isfinite", "isinf", "isnan"})
_MATH_TO_OTHER = frozenset({"frexp", "modf", "perm", "prod", "sumprod"})
_CALLS: Mapping[str, Value] = {
    "str": STRING,
    "repr": STRING,
    "int": INTEGER,
    "len": INTEGER,
    "ord": INTEGER,
    "chr": STRING,
    "float": NUMBER,
    "bool": BOOL,
    "isinstance": BOOL,
    "hasattr": BOOL,
    "callable": BOOL,
    "any": BOOL,
    "all": BOOL,
    "random.gauss": NUMBER,
    "random.randint": INTEGER,
    "random.random": NUMBER,
    "random.uniform": NUMBER,
    "statistics.fmean": NUMBER,
    "time.monotonic": NUMBER,
    "time.perf_counter": NUMBER,
    "time.time": NUMBER,
    "time.time_ns": INTEGER,
    "re.sub": STRING,
}
_COLLECTIONS: Mapping[str, type] = {
    "list": list,
    "sorted": list,
    "tuple": tuple,
    "set": set,
    "frozenset": frozenset,
    "bytes": bytes,
    "bytearray": bytearray,
    "iter": GeneratorType,
    "reversed": reversed,
    "collections.deque": deque,
    "itertools.cycle": itertools.cycle,
}
#: Constants of libraries.
NUMBERS = frozenset(
    {"math.e", "math.inf", "math.nan", "math.pi", "math.tau", "numpy.inf", "numpy.nan", "numpy.pi"}
)
_COPYING = frozenset({"copy.copy", "copy.deepcopy", "dataclasses.replace"})
_TEXTS = Collection(list, STRING)
_OF_TEXT: Mapping[str, Value] = {
    **dict.fromkeys(
        ("capitalize", "format", "join", "ljust", "lower", "lstrip", "removeprefix"), STRING
    ),
    **dict.fromkeys(
        ("removesuffix", "replace", "rjust", "rstrip", "strip", "title", "upper", "zfill"), STRING
    ),
    **dict.fromkeys(("endswith", "isalpha", "isdigit", "isidentifier", "startswith"), BOOL),
    **dict.fromkeys(("count", "find", "index", "rfind"), INTEGER),
    **dict.fromkeys(("rsplit", "split", "splitlines"), _TEXTS),
    "encode": Collection(bytes, INTEGER),
    "partition": pair(STRING, STRING, STRING),
    "rpartition": pair(STRING, STRING, STRING),
}
#: Exceptions from which libraries derive exceptions with more attributes.
_DERIVED_FROM = frozenset({BaseException, Exception})


def is_asynchronous(type_: Value) -> bool:
    """Return whether a value is iterated over by ``async for``."""
    asynchronous = (AsyncGeneratorType, AsyncIterator)
    return isinstance(type_, Collection) and type_.python in asynchronous


def sliced(owner: Value) -> Value:
    """Return the type of a slice of a value."""
    match owner:
        case Collection(python=python, element=element):
            return Collection(python, element)
        case FieldType(name=name) if owner.is_array:
            return FieldType(name, is_array=True)
        case BuiltinObject() if owner == ARRAY:
            return ARRAY
        case _:
            return STRING if is_text(owner) else ANYTHING


def called(name: str, arguments: Sequence[Value], keywords: Mapping[str, Value]) -> Value:
    """Return the type of a call of a built-in function or of one in the standard library."""
    module, _, function = name.rpartition(".")
    if module == "math":
        return _math(function)
    if name.startswith("numpy."):
        return numpy_result(name.removeprefix("numpy."), arguments, keywords)
    if name in _CALLS:
        return _CALLS[name]
    if name in _COPYING and len(arguments) == 1:
        return arguments[0]
    if name == "range":
        return Collection(range, INTEGER)
    if name in _COLLECTIONS:
        return _collection(_COLLECTIONS[name], arguments)
    special = _SPECIAL.get(name)
    return special(arguments, keywords) if special is not None else ANYTHING


def _collection(python: type, arguments: Sequence[Value]) -> Value:
    source = arguments[0] if len(arguments) == 1 else ANYTHING
    items = source.items if isinstance(source, Collection) and python is tuple else None
    is_empty = not arguments and python is not tuple
    return Collection(python, element_of(source), items=items, is_empty=is_empty)


def _math(function: str) -> Value:
    if function in _MATH_TO_OTHER:
        return ANYTHING
    if function in _MATH_TO_INTEGER:
        return INTEGER
    return BOOL if function in _MATH_TO_BOOL else NUMBER


def _dict(arguments: Sequence[Value], keywords: Mapping[str, Value]) -> Value:
    source = arguments[0] if len(arguments) == 1 and not keywords else ANYTHING
    if isinstance(source, Collection) and issubclass(source.python, Mapping):
        return Collection(dict, source.element, source.key, is_empty=source.is_empty)
    item = element_of(source)
    if isinstance(item, Collection) and item.items is not None and len(item.items) == _PAIR:
        key, value = item.items
        return Collection(dict, value, key)
    return Collection(dict)


def _counter(arguments: Sequence[Value], keywords: Mapping[str, Value]) -> Value:
    source = arguments[0] if len(arguments) == 1 and not keywords else ANYTHING
    return Collection(Counter, key=element_of(source))


def _from_keys(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    """Return the type of a call of ``dict.fromkeys``; None is the place of a value."""
    keys = element_of(arguments[0]) if arguments else ANYTHING
    value = arguments[1] if len(arguments) > 1 else NONE
    return Collection(dict, ANYTHING if value is NONE else value, keys)


def _default_dict(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    """Return the type of a call of ``defaultdict``, whose values are of the class it is given."""
    return Collection(dict, is_empty=len(arguments) <= 1)


def _least(arguments: Sequence[Value], keywords: Mapping[str, Value]) -> Value:
    """Return the type of a call of ``min`` or ``max``."""
    if len(arguments) > 1:
        is_mixed = all(map(is_number, arguments)) and any(map(is_float, arguments))
        return NUMBER if is_mixed else join_all(arguments)
    found = element_of(arguments[0]) if arguments else ANYTHING
    return join(found, keywords["default"]) if "default" in keywords else found


def _sum(arguments: Sequence[Value], keywords: Mapping[str, Value]) -> Value:
    element = element_of(arguments[0]) if len(arguments) == 1 and not keywords else ANYTHING
    if element == BOOL or is_integer(element):
        return INTEGER
    return NUMBER if is_float(element) else ANYTHING


def _divmod(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    if len(arguments) != _PAIR or not all(map(is_number, arguments)):
        return ANYTHING
    found = NUMBER if any(map(is_float, arguments)) else INTEGER
    return pair(found, found)


def _number(arguments: Sequence[Value], keywords: Mapping[str, Value]) -> Value:
    """Return the type of a call of ``abs``."""
    only = arguments[0] if len(arguments) == 1 and not keywords else ANYTHING
    return only if is_number(only) else ANYTHING


def _round(arguments: Sequence[Value], keywords: Mapping[str, Value]) -> Value:
    only = arguments[0] if len(arguments) == 1 and not keywords else ANYTHING
    return INTEGER if is_number(only) else ANYTHING


def _from_heap(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return element_of(arguments[0]) if arguments else ANYTHING


def _of_heap(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return Collection(list, element_of(arguments[1])) if len(arguments) == _PAIR else ANYTHING


_PATTERN = BuiltinObject(re.Pattern)
_MATCH = BuiltinObject(re.Match)
#: The results of methods of objects of the standard library.
_METHODS: Mapping[tuple[type, str], Value] = {
    **{(re.Pattern, name): _MATCH for name in ("fullmatch", "match", "search")},
    (re.Pattern, "finditer"): Collection(GeneratorType, _MATCH),
    (re.Pattern, "split"): Collection(list, STRING),
    (re.Pattern, "sub"): STRING,
    (re.Match, "end"): INTEGER,
    (re.Match, "groups"): Collection(tuple, STRING),
    (re.Match, "start"): INTEGER,
}


def builtin_result(
    python: type, name: str, arguments: Sequence[Value], keywords: Mapping[str, Value]
) -> Value:
    """Return the type of what a method of an object of the standard library or numpy returns."""
    of_numpy = numpy_method_result(python, name, keywords)
    if of_numpy is not None:
        return of_numpy
    if (python, name) == (re.Match, "group"):
        return STRING if len(arguments) <= 1 else Collection(tuple, STRING)
    if python.__module__ == "random":
        return _CALLS.get(f"random.{name}", ANYTHING)
    return _METHODS.get((python, name), ANYTHING)


def _match(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return ANYTHING if _is_of_bytes(arguments) else _MATCH


def _pattern(arguments: Sequence[Value], _: Mapping[str, Value]) -> Value:
    return ANYTHING if _is_of_bytes(arguments) else _PATTERN


def _is_of_bytes(arguments: Sequence[Value]) -> bool:
    pattern = arguments[0] if arguments else ANYTHING
    return isinstance(pattern, Collection) and pattern.python is bytes


def _random(_: Sequence[Value], __: Mapping[str, Value]) -> Value:
    return BuiltinObject(importlib.import_module("random").Random)  # it takes time to import


_SPECIAL: Mapping[str, Callable[[Sequence[Value], Mapping[str, Value]], Value]] = {
    **OF_ITERABLES,
    "abs": _number,
    "collections.Counter": _counter,
    "collections.OrderedDict": _dict,
    "collections.defaultdict": _default_dict,
    "dict": _dict,
    "dict.fromkeys": _from_keys,
    "divmod": _divmod,
    "heapq.heappop": _from_heap,
    "heapq.heappushpop": _from_heap,
    "heapq.heapreplace": _from_heap,
    "heapq.nlargest": _of_heap,
    "heapq.nsmallest": _of_heap,
    "max": _least,
    "min": _least,
    "random.Random": _random,
    "re.compile": _pattern,
    "re.fullmatch": _match,
    "re.match": _match,
    "re.search": _match,
    "round": _round,
    "sum": _sum,
}
_PAIR = 2


#: Methods that change a collection and return None.
IN_PLACE = frozenset(
    {"add", "append", "appendleft", "clear", "discard", "extend", "insert", "remove", "reverse"}
    | {"sort", "update"}
)


def method_result(owner: Collection, name: str, arguments: Sequence[Value]) -> Value:
    """Return the type of what a method of a collection or of a text returns."""
    if owner.python is str:
        return _OF_TEXT.get(name, ANYTHING)
    if issubclass(owner.python, Mapping):
        return _of_dict(owner, name, arguments)
    if name in {"copy", "difference", "intersection"}:
        return owner
    if name in {"count", "index"}:
        return INTEGER
    if name == "decode" and owner.python in (bytes, bytearray):
        return STRING
    if name in {"pop", "popleft"} and len(arguments) <= 1:
        return owner.element
    return NONE if name in IN_PLACE else ANYTHING


def _of_dict(owner: Collection, name: str, arguments: Sequence[Value]) -> Value:
    match name:
        case "values":
            return Collection(_VALUES, owner.element)
        case "keys":
            return Collection(_KEYS, owner.key)
        case "items":
            return Collection(_ITEMS, pair(owner.key, owner.element))
        case "get" | "pop" | "setdefault":
            return join_all((owner.element, *arguments[1:]))
        case "copy":
            return owner
        case "most_common" if owner.python is Counter:
            return Collection(list, pair(owner.key, owner.element))
        case _:
            return ANYTHING


def exception_type(name: str) -> Value:
    """Return the type of a caught exception, ANYTHING if it may have further attributes."""
    module, _, last = name.rpartition(".")
    home = {"": builtins, "composer.behavior": behavior}.get(module)
    found = getattr(home, last, None)
    if not isinstance(found, type) or not issubclass(found, BaseException):
        return ANYTHING
    return ANYTHING if found in _DERIVED_FROM else BuiltinObject(found)
