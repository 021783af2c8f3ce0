"""A ``dataclass`` that is defined in a quarter of the time, because a command defines over 150.

See docs/decisions/0049-fast-dataclasses.md.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any, cast


def _dataclass(
    *, frozen: bool = False, eq: bool = True, slots: bool = False
) -> Callable[[type], type]:
    """Work as ``dataclasses.dataclass``, but leave it to mypy to enforce ``frozen``.

    Only ``__init__`` is generated as code; the other methods are shared or closures.
    """

    def define(cls: type) -> type:
        own = vars(cls)
        if cls.__doc__ is None:
            cls.__doc__ = cls.__name__  # dataclasses would format the signature
        made: Any = dataclasses.dataclass(eq=False, repr=False, slots=slots)(cls)
        if "__repr__" not in own:
            made.__repr__ = _repr
        if eq and "__eq__" not in own:
            _compare_by_value(made, hashable=frozen)
        return cast("type", made)

    return define


def _compare_by_value(cls: Any, *, hashable: bool) -> None:
    names = [field.name for field in dataclasses.fields(cls) if field.compare]
    key: Callable[[object], object] = attrgetter(*names) if names else lambda _: ()

    def equals(self: object, other: object) -> bool:
        return key(self) == key(other) if other.__class__ is self.__class__ else NotImplemented

    cls.__eq__ = equals
    cls.__hash__ = (lambda self: hash(key(self))) if hashable else None


@recursive_repr()
def _repr(self: Any) -> str:
    shown = (field.name for field in dataclasses.fields(self) if field.repr)
    values = ", ".join(f"{name}={getattr(self, name)!r}" for name in shown)
    return f"{type(self).__qualname__}({values})"


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass  # noqa: PLC0414 (exported)
else:
    dataclass = _dataclass
