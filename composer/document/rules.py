"""The rules of reading YAML (RC0xx)."""

from __future__ import annotations

from composer.diagnostics import error

UNREADABLE_FILE = error("RC001", "unreadable-file")
FILE_TOO_LARGE = error("RC002", "file-too-large")
NOT_UTF8 = error("RC003", "not-utf8")
FORBIDDEN_CHARACTER = error("RC004", "forbidden-character")
YAML_SYNTAX = error("RC005", "yaml-syntax")
NESTED_TOO_DEEP = error("RC006", "nested-too-deep")
TOO_MANY_VALUES = error("RC007", "too-many-values")
SEVERAL_DOCUMENTS = error("RC008", "several-documents")
NOT_A_MAP = error("RC009", "not-a-map")
YAML_TAG = error("RC010", "yaml-tag")
DUPLICATE_KEY = error("RC011", "duplicate-key")
KEY_NOT_STRING = error("RC012", "key-not-string")
MERGE_KEY = error("RC013", "merge-key")
BAD_NUMBER = error("RC014", "bad-number")
BAD_ALIAS = error("RC015", "bad-alias")
KEY_WITHOUT_VALUE = error("RC016", "key-without-value")
