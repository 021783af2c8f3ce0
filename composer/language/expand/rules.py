"""The rules of load-time variables and copies (RC28x)."""

from __future__ import annotations

from composer.base.diagnostics import error, info

UNKNOWN_VARIABLE = error("RC281", "unknown-variable")
MALFORMED_VARIABLE = error("RC282", "malformed-variable")
CYCLE = error("RC283", "cycle")
DUPLICATE_NAME = error("RC225", "duplicate-name")
UNUSED_DECLARATION = info("RC242", "unused-declaration")
