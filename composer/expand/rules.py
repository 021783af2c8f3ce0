"""The rules of load-time variables and copies (RC28x)."""

from __future__ import annotations

from composer.diagnostics import error, info

UNKNOWN_VARIABLE = error("RC281", "unknown-variable")
MALFORMED_VARIABLE = error("RC282", "malformed-variable")
CYCLIC_VARIABLES = error("RC283", "cyclic-variables")
NOT_A_TEXT = error("RC284", "variable-not-string")
TOO_LARGE = error("RC285", "variables-too-large")
UNUSED_VARIABLE = info("RC286", "unused-variable")
DUPLICATE_NODE_NAME = error("RC288", "duplicate-node-name")
