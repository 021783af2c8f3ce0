"""The rules of reading files: YAML, schema, load-time variables and copies."""

from __future__ import annotations

from composer.base.diagnostics import error, info

UNREADABLE_FILE = error("RC001", "unreadable-file")
TOO_LARGE = error("RC002", "too-large")
FORBIDDEN_CHARACTER = error("RC004", "forbidden-character")
YAML_SYNTAX = error("RC005", "yaml-syntax")
UNSUPPORTED_YAML = error("RC010", "unsupported-yaml")
DUPLICATE_KEY = error("RC011", "duplicate-key")
BAD_NUMBER = error("RC014", "bad-number")
KEY_WITHOUT_VALUE = error("RC016", "key-without-value")

UNKNOWN_KEY = error("RC101", "unknown-key")
MISSING_KEY = error("RC102", "missing-key")
WRONG_TYPE = error("RC103", "wrong-type")
UNKNOWN_WORD = error("RC104", "unknown-word")
OUT_OF_RANGE = error("RC105", "out-of-range")
KEYS_EXCLUDE_EACH_OTHER = error("RC106", "keys-exclude-each-other")
EMPTY_COLLECTION = error("RC107", "empty-collection")

UNKNOWN_VARIABLE = error("RC281", "unknown-variable")
MALFORMED_VARIABLE = error("RC282", "malformed-variable")
MISSING_VARIABLE = error("RC287", "missing-variable")
CYCLE = error("RC283", "cycle")
DUPLICATE_NAME = error("RC225", "duplicate-name")
UNUSED_DECLARATION = info("RC242", "unused-declaration")
