"""ROS parameter files as rcl_yaml_param_parser reads them: ``off`` is false, ``010`` is 8.

rcl decides by the C functions ``strtoll`` (base 0) and ``strtod`` whether an unquoted scalar is a
number. Every other text is a string, also ``null`` and ``~``.
"""

from __future__ import annotations

import math
import re
import sys

import yaml

from composer.base.diagnostics import Diagnostic, shown
from composer.base.source import SourceFile
from composer.language import rules
from composer.language.document.builder import TreeBuilder, scalar_span, span_at
from composer.language.document.scalars import NumberRefused, check_value
from composer.language.rules import MAX_NUMBER_LENGTH, Stopped
from composer.language.tree import Mapping, Scalar, ScalarValue, Tree

_TRUE = frozenset(["Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"])
_FALSE = frozenset(["N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"])
_INFINITE = ("inf", "Inf", "INF")
_INTEGER = re.compile(r"[-+]?(?:(?P<hex>0[xX][0-9a-fA-F]+)|(?P<octal>0[0-7]*)|[1-9][0-9]*)")
_YAML_NOT_FINITE = {
    **{f"{sign}.{word}": float(f"{sign}inf") for sign in ("", "+", "-") for word in _INFINITE},
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
}
_C_NOT_FINITE = re.compile(
    r"(?P<number>[-+]?(?:inf(?:inity)?|nan))(?:(?<=nan)\([0-9a-z_]*\))?", re.IGNORECASE
)
_DECIMAL = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_HEXADECIMAL = re.compile(
    r"[-+]?0[xX](?:[0-9a-fA-F]+\.?[0-9a-fA-F]*|\.[0-9a-fA-F]+)(?:[pP][-+]?[0-9]+)?"
)
_ZERO = re.compile(r"[-+]?(?:0[xX])?[0.]+(?:[eEpP].*)?")
_QUOTED = ("'", '"')
_STRING_TAG = "tag:yaml.org,2002:str"


def resolve_parameter(text: str) -> ScalarValue:
    """Return the value that rcl reads from an unquoted scalar. Raises NumberRefused."""
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    number = text.lstrip(" \t\n\v\f\r")
    integer = _integer(number)
    value = _float(number) if integer is None else integer
    return text if value is None else value


def _integer(text: str) -> int | None:
    """Return what ``strtoll`` reads, or None."""
    match = _INTEGER.fullmatch(text)
    if match is None:
        return None
    _check_length(text)
    value = int(text, 16 if match["hex"] else 8 if match["octal"] else 10)
    return value if -(2**63) <= value < 2**63 else None


def _float(text: str) -> float | None:
    """Return what ``strtod`` reads, or None. It refuses numbers that a double cannot hold."""
    if text in _YAML_NOT_FINITE:
        return _YAML_NOT_FINITE[text]
    not_finite = _C_NOT_FINITE.fullmatch(text)
    if not_finite is not None:
        return float(not_finite["number"])
    if _DECIMAL.fullmatch(text):
        _check_length(text)
        value = float(text)
    elif _HEXADECIMAL.fullmatch(text):
        _check_length(text)
        try:
            value = float.fromhex(text)
        except OverflowError:
            return None
    else:
        return None
    if _ZERO.fullmatch(text):
        return value
    return value if sys.float_info.min <= abs(value) <= sys.float_info.max else None


def _check_length(text: str) -> None:
    if len(text) > MAX_NUMBER_LENGTH:
        raise NumberRefused(f"has more than {MAX_NUMBER_LENGTH} digits")


class ParameterFileBuilder(TreeBuilder):
    """Handles the events of a parameter file.

    A key is text, whatever it looks like, and may occur again in the same map. All tags but
    ``!!str`` are ignored. Documents follow each other as if they were one.
    """

    def __init__(self, source: SourceFile) -> None:
        super().__init__(source, resolve_parameter)
        self._documents: list[Tree] = []

    def _scalar(self, event: yaml.ScalarEvent) -> Scalar:
        span, verbatim, offset = scalar_span(self._source, event)
        text, diagnostics = check_value(event.value or "", span)
        self.diagnostics += diagnostics
        value: ScalarValue = text
        if event.style not in _QUOTED:
            if not text:
                value = None
            elif event.tag != _STRING_TAG:
                value = self._plain(text, span)
        return Scalar(value, span, verbatim, offset)

    def _key(self, scalar: Scalar, event: yaml.ScalarEvent, _: object) -> Scalar | None:
        if not event.value:
            self._report(rules.UNSUPPORTED_YAML, "a key is missing here", scalar.span, None)
            return None
        return Scalar(event.value, scalar.span, scalar.verbatim, scalar.content_offset)

    def _report_tag(self, tag: str, mark: object) -> None:
        pass

    def _on_alias(self, event: yaml.AliasEvent) -> None:
        name = shown(event.anchor or "")
        span = span_at(self._source, event.start_mark, len(event.anchor or "") + 1)
        message = f"'*{name}' is an alias, which ROS refuses in parameter files"
        hint = "write out the value, or quote the text"
        raise Stopped(Diagnostic(rules.UNSUPPORTED_YAML, message, span, hint=hint))

    def _on_document(self, event: yaml.DocumentStartEvent) -> None:
        pass

    def _finish(self, tree: Tree) -> None:
        self._documents.append(tree)
        self.root = tree

    def merged(self) -> Tree | None:
        """Return the entries of all documents, or the first document that is not a map."""
        other = next((tree for tree in self._documents if not isinstance(tree, Mapping)), None)
        if other is not None or not self._documents:
            return other
        maps = [tree for tree in self._documents if isinstance(tree, Mapping)]
        return Mapping(tuple(entry for tree in maps for entry in tree), maps[0].span)
