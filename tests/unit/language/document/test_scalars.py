"""Plain scalars by the core schema of YAML 1.2, and none other."""

from __future__ import annotations

import pytest

from composer.base.source import SourceFile
from composer.language.document import parse_document
from composer.language.tree import ScalarValue, plain
from tests.unit.support.resolving import tree_of


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("~", None),
        ("null", None),
        ("Null", None),
        ("NULL", None),
        ("nULL", "nULL"),
        ("true", True),
        ("False", False),
        ("TRUE", True),
        ("tRUE", "tRUE"),
        # Truth values, octals, sexagesimals, dates of YAML 1.1 are texts or plain numbers.
        ("NO", "NO"),
        ("on", "on"),
        ("y", "y"),
        ("0755", 755),
        ("08", 8),
        ("22:22", "22:22"),
        ("1_000", "1_000"),
        ("0b11", "0b11"),
        ("2024-13-01", "2024-13-01"),
        ("0o17", 15),
        ("0o18", "0o18"),
        ("0x1F", 31),
        ("-0x1F", "-0x1F"),
        ("0", 0),
        ("-7", -7),
        ("+7", 7),
        ("1.0", 1.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("-.5", -0.5),
        ("1e3", 1000.0),
        ("1.5E-3", 0.0015),
        (".", "."),
        ("--", "--"),
        ("1.2.3", "1.2.3"),
        ("1e", "1e"),
        ("e3", "e3"),
        ("inf", "inf"),
        ("nan", "nan"),
        ("18446744073709551615", 2**64 - 1),
        ("-9223372036854775808", -(2**63)),
        ("'1'", "1"),
        ('"true"', "true"),
        ("'~'", "~"),
        ("''", ""),
        ("=", "="),
        ("<<", "<<"),
        ("١٢", "١٢"),  # digits, but not those of YAML
    ],
)
def test_scalar(text: str, value: ScalarValue) -> None:
    found = tree_of(f"a: {text}").get("a")
    assert found is not None
    assert repr(plain(found)) == repr(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (".nan", "'.nan' is not a finite number"),
        (".NaN", "'.NaN' is not a finite number"),
        (".inf", "'.inf' is not a finite number"),
        ("-.Inf", "'-.Inf' is not a finite number"),
        ("1e999", "'1e999' is larger than a double can hold"),
        ("18446744073709551616", "'18446744073709551616' does not fit into 64 bits"),
        ("-9223372036854775809", "'-9223372036854775809' does not fit into 64 bits"),
        ("0xFFFFFFFFFFFFFFFFF", "'0xFFFFFFFFFFFFFFFFF' does not fit into 64 bits"),
        ("9" * 5000, f"'{'9' * 77}...' has more than 100 digits"),
        ("0." + "3" * 5000, f"'0.{'3' * 75}...' has more than 100 digits"),
    ],
)
def test_refused_number(text: str, message: str) -> None:
    _, diagnostics = parse_document(SourceFile("f", f"a: {text}"))
    assert [(diagnostic.rule.name, diagnostic.message) for diagnostic in diagnostics] == [
        ("bad-number", message)
    ]
    assert (diagnostics[0].primary.column, diagnostics[0].primary.length) == (4, len(text))
