"""The rules of the schema (RC1xx): keys and values that the language does not have."""

from __future__ import annotations

from composer.base.diagnostics import error

UNKNOWN_KEY = error("RC101", "unknown-key")
MISSING_KEY = error("RC102", "missing-key")
WRONG_TYPE = error("RC103", "wrong-type")
UNKNOWN_WORD = error("RC104", "unknown-word")
OUT_OF_RANGE = error("RC105", "out-of-range")
KEYS_EXCLUDE_EACH_OTHER = error("RC106", "keys-exclude-each-other")
EMPTY_COLLECTION = error("RC107", "empty-collection")
