"""Plain scalars by the core schema of YAML 1.2, and none other."""

from __future__ import annotations

import pytest

from composer.base.source import SourceFile
from composer.language.document import parse_document
from composer.language.tree import ScalarValue, plain
from tests.unit.support.resolving import tree_of

#: Texts, also those which YAML 1.1 reads as truth values, sexagesimals, octals or dates.
TEXTS = ("nULL", "tRUE", "NO", "on", "y", "22:22", "1_000", "0b11", "2024-13-01", "0o18", "-0x1F")
TEXTS += (".", "--", "1.2.3", "1e", "e3", "inf", "nan", "=", "<<")
TEXTS += ("١٢",)  # digits, but not those of YAML


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *((text, None) for text in ("~", "null", "Null", "NULL")),
        *((text, text) for text in TEXTS),
        ("true", True),
        ("False", False),
        ("TRUE", True),
        ("0755", 755),
        ("08", 8),
        ("0o17", 15),
        ("0x1F", 31),
        ("0", 0),
        ("-7", -7),
        ("+7", 7),
        ("1.0", 1.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("-.5", -0.5),
        ("1e3", 1000.0),
        ("1.5E-3", 0.0015),
        ("18446744073709551615", 2**64 - 1),
        ("-9223372036854775808", -(2**63)),
        ("'1'", "1"),
        ('"true"', "true"),
        ("'~'", "~"),
        ("''", ""),
    ],
)
def test_scalar(text: str, value: ScalarValue) -> None:
    assert repr(plain(tree_of(f"a: {text}").get("a"))) == repr(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *((text, f"'{text}' is not a finite number") for text in (".nan", ".NaN", ".inf", "-.Inf")),
        ("1e999", "'1e999' is larger than a double can hold"),
        ("18446744073709551616", "'18446744073709551616' does not fit into 64 bits"),
        ("-9223372036854775809", "'-9223372036854775809' does not fit into 64 bits"),
        ("0xFFFFFFFFFFFFFFFFF", "'0xFFFFFFFFFFFFFFFFF' does not fit into 64 bits"),
        ("9" * 5000, f"'{'9' * 77}...' has more than 100 digits"),
        ("0." + "3" * 5000, f"'0.{'3' * 75}...' has more than 100 digits"),
    ],
)
def test_refused_number(text: str, message: str) -> None:
    _, [found] = parse_document(SourceFile("f", f"a: {text}"))
    assert (found.rule.name, found.message) == ("bad-number", message)
    assert (found.primary.column, found.primary.length) == (4, len(text))
