"""The rules of reading YAML (RC0xx)."""

from __future__ import annotations

from composer.base.diagnostics import error

UNREADABLE_FILE = error("RC001", "unreadable-file")
TOO_LARGE = error("RC002", "too-large")
FORBIDDEN_CHARACTER = error("RC004", "forbidden-character")
YAML_SYNTAX = error("RC005", "yaml-syntax")
UNSUPPORTED_YAML = error("RC010", "unsupported-yaml")
DUPLICATE_KEY = error("RC011", "duplicate-key")
BAD_NUMBER = error("RC014", "bad-number")
KEY_WITHOUT_VALUE = error("RC016", "key-without-value")
