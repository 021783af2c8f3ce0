"""A ``dataclass`` that is defined in a tenth of the time, because a command defines 200 to 300.

See docs/decisions/0014-start-up.md.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Iterable
from functools import cache
from operator import attrgetter, methodcaller
from reprlib import recursive_repr
from types import CellType, CodeType, FunctionType
from typing import TYPE_CHECKING, Any, cast

_Complete = Callable[[Any], None]


class _Factory:
    """The default of a parameter whose field has a default factory."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY = _Factory()


def _dataclass(
    *, frozen: bool = False, eq: bool = True, slots: bool = False
) -> Callable[[type], type]:
    """Work as ``dataclasses.dataclass``, but leave it to mypy to enforce ``frozen``.

    A field with ``init=False`` has no default. No code is generated: ``__init__`` is a copy of one
    function for each number of fields, the other methods are shared or closures.
    """

    def define(cls: type) -> type:
        own = vars(cls)
        if cls.__doc__ is None:
            cls.__doc__ = cls.__name__  # dataclasses would format the signature
        made: Any = dataclasses.dataclass(init=False, eq=False, repr=False, slots=slots)(cls)
        if "__init__" not in own:
            made.__init__ = _initializer(made)
        if "__repr__" not in own:
            made.__repr__ = _repr
        if eq and "__eq__" not in own:
            _compare_by_value(made, hashable=frozen)
        return cast("type", made)

    return define


def _initializer(cls: Any) -> FunctionType:
    parameters = [field for field in dataclasses.fields(cls) if field.init]
    parameters.sort(key=lambda field: bool(field.kw_only))
    names = tuple(field.name for field in parameters)
    defaults = {field.name: default for field in parameters for default in _default(field)}
    keywords = [field.name for field in parameters if field.kw_only]
    complete = _completion(cls)
    code = _assignments(len(names), complete is not None).replace(
        co_argcount=1 + len(names) - len(keywords),
        co_kwonlyargcount=len(keywords),
        co_varnames=("self", *names),
        co_names=names,
    )
    positional = tuple(value for name, value in defaults.items() if name not in keywords)
    closure = None if complete is None else (CellType(complete),)
    module = vars(sys.modules[cls.__module__])
    init = FunctionType(code, module, "__init__", positional, closure)
    init.__kwdefaults__ = {name: defaults[name] for name in keywords if name in defaults}
    init.__annotations__ = {field.name: field.type for field in parameters}
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    return init


def _default(field: dataclasses.Field[Any]) -> tuple[object, ...]:
    if field.default_factory is not dataclasses.MISSING:
        return (_FACTORY,)
    return () if field.default is dataclasses.MISSING else (field.default,)


@cache
def _assignments(count: int, completes: bool) -> CodeType:
    """Return the code of an ``__init__`` that assigns its parameters to fields of their names.

    The caller replaces the names: compiling an ``__init__`` takes twenty times longer.
    """
    names = [f"field_{number}" for number in range(count)]
    lines = [f"self.{name} = {name}" for name in names]
    lines += ["complete(self)"] if completes else ["pass"]
    body = "\n  ".join(lines)
    text = (
        f"def outer(complete):\n def init({', '.join(['self', *names])}):\n  {body}\n return init"
    )
    namespace: dict[str, Any] = {}
    exec(text, namespace)  # noqa: S102
    return cast("CodeType", namespace["outer"](None).__code__)


def _completion(cls: Any) -> _Complete | None:
    """Return what completes an object: default factories and ``__post_init__``, if it has any."""
    factories = [
        (field.name, field.default_factory)
        for field in dataclasses.fields(cls)
        if field.default_factory is not dataclasses.MISSING
    ]
    after = methodcaller("__post_init__") if hasattr(cls, "__post_init__") else None
    if not factories:
        return after

    def complete(self: Any) -> None:
        for name, factory in factories:
            if getattr(self, name, _FACTORY) is _FACTORY:
                setattr(self, name, factory())
        if after is not None:
            after(self)

    return complete


def _compare_by_value(cls: Any, *, hashable: bool) -> None:
    names = [field.name for field in dataclasses.fields(cls) if field.compare]
    key: Callable[[object], object] = attrgetter(*names) if names else lambda _: ()

    def equals(self: object, other: object) -> bool:
        return key(self) == key(other) if other.__class__ is self.__class__ else NotImplemented

    cls.__eq__ = equals
    cls.__hash__ = (lambda self: hash(key(self))) if hashable else None


def _replaced(instance: Any, /, **changes: object) -> Any:
    """Work as ``dataclasses.replace``, in a third of the time: most fields go by position."""
    cls: Any = type(instance)
    places, values_of, keywords = _fields_to_copy(cls)
    values = [*values_of(instance)]
    for name, value in changes.items():
        values[places[name]] = value
    if not keywords:
        return cls(*values)
    by_position = len(values) - len(keywords)
    return cls(*values[:by_position], **dict(zip(keywords, values[by_position:], strict=True)))


@cache
def _fields_to_copy(
    cls: Any,
) -> tuple[dict[str, int], Callable[[object], Iterable[object]], tuple[str, ...]]:
    """Return the places of the parameters of ``__init__``, their values, and keyword-only names."""
    parameters = sorted(
        (field for field in dataclasses.fields(cls) if field.init),
        key=lambda field: bool(field.kw_only),
    )
    names = tuple(field.name for field in parameters)
    values_of = attrgetter(*names) if len(names) > 1 else lambda own: [getattr(own, *names)]
    keywords = tuple(field.name for field in parameters if field.kw_only)
    return {name: place for place, name in enumerate(names)}, values_of, keywords


@recursive_repr()
def _repr(self: Any) -> str:
    shown = (field.name for field in dataclasses.fields(self) if field.repr)
    values = ", ".join(f"{name}={getattr(self, name)!r}" for name in shown)
    return f"{type(self).__qualname__}({values})"


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass  # noqa: PLC0414 (exported)
    from dataclasses import replace as replace  # noqa: PLC0414 (exported)
else:
    dataclass = _dataclass
    replace = _replaced
