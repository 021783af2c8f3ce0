"""The fast dataclass against the one of the standard library."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import pytest

from composer.base.fast_dataclass import dataclass

Decorator = Callable[..., Callable[[type], type]]


def _point(decorator: Decorator, **options: bool) -> Any:
    @decorator(**options)
    class Point:
        x: int
        y: int = 0
        note: str = dataclasses.field(default="", compare=False)
        secret: str = dataclasses.field(default="", repr=False)

    return Point


@pytest.fixture(params=[True, False], ids=["frozen", "mutable"])
def frozen(request: pytest.FixtureRequest) -> bool:
    return bool(request.param)


@pytest.fixture(params=[dataclass, dataclasses.dataclass], ids=["fast", "standard"])
def point(request: pytest.FixtureRequest, frozen: bool) -> Any:
    return _point(request.param, frozen=frozen, slots=True)


def test_comparing_hashing_showing_and_copying(point: Any, frozen: bool) -> None:
    assert point(1, note="a") == point(1, note="b")
    assert point(1) != point(2)
    assert point(1) != (1, 0, "")
    assert point(1) != _point(dataclass)(1)
    if frozen:
        assert {point(1, note="a"), point(1, note="b"), point(2)} == {point(1), point(2)}
    else:
        with pytest.raises(TypeError, match="unhashable"):
            hash(point(1))
    assert repr(point(1, note="a", secret="b")).endswith("Point(x=1, y=0, note='a')")
    assert deepcopy(point(1, 2)) == dataclasses.replace(point(1, 0), y=2) == point(1, 2)
    assert dataclasses.asdict(point(1)) == {"x": 1, "y": 0, "note": "", "secret": ""}
    assert not hasattr(point(1), "__dict__")


@pytest.mark.parametrize("decorator", [dataclass, dataclasses.dataclass])
def test_init_takes_the_parameters_of_the_fields_and_completes_the_object(
    decorator: Decorator,
) -> None:
    @decorator(slots=True)
    class Base:
        x: int
        items: list[int] = dataclasses.field(default_factory=list)
        unit: str = dataclasses.field(default="m", kw_only=True)
        total: int = dataclasses.field(init=False)

        def __post_init__(self) -> None:
            self.total = self.x + sum(self.items)

    @decorator(slots=True)
    class Derived(Base):
        scale: float = 1.0

    made: Any = Derived
    one = made(1, [2], 3.0, unit="s")
    assert (one.x, one.items, one.scale, one.unit, one.total) == (1, [2], 3.0, "s", 3)
    assert made(1).items == []
    assert made(1).items is not made(1).items
    assert list(inspect.signature(made).parameters) == ["x", "items", "scale", "unit"]
    with pytest.raises(TypeError, match=r"Derived\.__init__\(\) missing 1 required .*'x'"):
        made()


@dataclass(frozen=True, slots=True)
class _Empty:
    pass


@dataclass(frozen=True, slots=True, eq=False)
class _Identity:
    value: int


@dataclass(frozen=True, slots=True)
class _Own:
    """A class with a representation of its own."""

    value: int

    def __repr__(self) -> str:
        return f"<{self.value}>"


def test_classes_without_fields_or_with_methods_of_their_own() -> None:
    assert _Empty() == _Empty()
    assert hash(_Empty()) == hash(_Empty())
    assert _Empty() != _Identity(1)
    one = _Identity(1)
    assert one == one  # noqa: PLR0124
    assert one != _Identity(1)
    assert len({one, one, _Identity(1)}) == 2
    assert repr(_Own(3)) == "<3>"
    assert pickle.loads(pickle.dumps(_Own(3))) == _Own(3)
