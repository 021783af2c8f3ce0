"""The rules of ``include`` and ``extends`` (RC29x)."""

from __future__ import annotations

from composer.diagnostics import error

INVALID_INCLUDE = error("RC290", "invalid-include")
UNKNOWN_OVERRIDE = error("RC293", "unknown-override")
UNKNOWN_BASE = error("RC295", "unknown-base")
