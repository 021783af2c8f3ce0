"""The conditions of what only some visits of a launch file have shown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from composer.launch.variants import identifier, is_switch, mark

#: A value of each argument; None for any.
_Group = tuple[str | None, ...]


def condition(visits: Sequence[Mapping[str, str]], present: Iterable[int]) -> dict[str, str]:
    """Return the condition of what is present in these visits; empty for all of them.

    The first visit has the defaults.
    """
    numbers = frozenset(present)
    names = [*visits[0]]
    for name in tuple(names):  # those that decide nothing
        fewer = [other for other in names if other != name]
        if _are_enough(fewer, visits, numbers):
            names = fewer
    if not names:
        return {}
    groups: dict[_Group, bool] = {tuple(item[name] for name in names): False for item in visits}
    for number in numbers:
        groups[tuple(visits[number][name] for name in names)] = True
    constants = {name: sorted({item[name] for item in visits} - {mark(name)}) for name in names}
    numbers_of_values = [len({item[name] for item in visits}) for name in names]
    there = _merged([group for group, is_there in groups.items() if is_there], numbers_of_values)
    absent = _merged(
        [group for group, is_there in groups.items() if not is_there], numbers_of_values
    )
    present_if = " or ".join(_terms(constants, there))
    absent_if = " or ".join(_terms(constants, absent))
    are_known = all(
        is_switch(constants[name]) or any(item[name] == mark(name) for item in visits)
        for name in names
    )
    if len(there) != len(absent):
        is_positive = len(there) < len(absent)
    elif are_known:
        is_positive = len(present_if) <= len(absent_if)
    else:  # what other values choose is not known: they have what the default has
        is_positive = 0 not in numbers
    return {"if": present_if} if is_positive else {"unless": absent_if}


def _are_enough(
    names: Sequence[str], visits: Sequence[Mapping[str, str]], present: frozenset[int]
) -> bool:
    """Return whether these arguments alone decide what is present."""
    found: dict[tuple[str, ...], bool] = {}
    return all(
        found.setdefault(tuple(item[name] for name in names), number in present)
        == (number in present)
        for number, item in enumerate(visits)
    )


def _merged(groups: Sequence[_Group], numbers_of_values: Sequence[int]) -> list[_Group]:
    """Return the groups with None in place of all values of an argument, if the rest is equal."""
    merged = [*groups]
    for position, number in enumerate(numbers_of_values):
        by_rest: dict[_Group, list[_Group]] = {}
        for group in merged:
            rest = (*group[:position], None, *group[position + 1 :])
            by_rest.setdefault(rest, []).append(group)
        merged = []
        for rest, same in by_rest.items():
            merged += [rest] if len(same) == number else same
    return merged


def _terms(constants: Mapping[str, Sequence[str]], groups: Iterable[_Group]) -> Iterator[str]:
    for group in groups:
        pairs = zip(constants, group, strict=True)
        yield " and ".join(
            _term(name, value, constants[name]) for name, value in pairs if value is not None
        )


def _term(name: str, value: str, constants: Sequence[str]) -> str:
    """Return a comparison; a mark is any value but the ``constants``."""
    variable = identifier(name)
    if value == mark(name):
        return " and ".join(f"{variable} != {_quoted(text)}" for text in constants)
    if is_switch(constants):
        return variable if value.lower() == "true" else f"not {variable}"
    return f"{variable} == {_quoted(value)}"


def _quoted(text: str) -> str:
    quote = '"' if "'" in text else "'"
    return f"{quote}{text}{quote}"
