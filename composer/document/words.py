"""What a value is, in the words that messages use."""

from __future__ import annotations

from composer.diagnostics import shown
from composer.tree import Mapping, Scalar, Sequence, Tree


def described(tree: Tree) -> str:
    """Return ``a map``, ``a list``, ``nothing``, ``true``, ``the number 5`` or ``text 'abc'``."""
    match tree:
        case Mapping():
            return "a map"
        case Sequence():
            return "a list"
        case Scalar(value=None):
            return "nothing"
        case Scalar(value=bool()):
            return shown(tree.value)
        case Scalar(value=str()):
            return f"text '{shown(tree.value)}'"
        case Scalar():
            return f"the number {shown(tree.value)}"
