"""The guides document the whole API of behaviors."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

from composer import behavior

GUIDE = Path(__file__).parents[3] / "docs" / "guides" / "behaviors.md"
CLASSES = [
    item
    for name, item in vars(behavior).items()
    if inspect.isclass(item) and item.__module__ == behavior.__name__
]


@pytest.mark.parametrize("item", CLASSES, ids=lambda item: item.__name__)
def test_exceptions_attributes_and_methods_are_in_the_guide(item: type) -> None:
    text = GUIDE.read_text(encoding="utf-8")
    if issubclass(item, Exception):
        assert f"`{item.__name__}`" in text
        return
    names = vars(item) if item is not behavior.Behavior else behavior.Behavior.__annotations__
    public = [name for name in names if not name.startswith("_")]
    assert [name for name in public if f"{name}" not in text] == []
