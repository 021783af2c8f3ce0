"""The rules of ``include`` and ``extends`` (RC29x)."""

from __future__ import annotations

from composer.diagnostics import error

INVALID_INCLUDE = error("RC290", "invalid-include")
INCLUDE_CYCLE = error("RC291", "include-cycle")
INCLUDE_CONFLICT = error("RC292", "include-conflict")
UNKNOWN_OVERRIDE = error("RC293", "unknown-override")
TOO_MUCH_INCLUDED = error("RC294", "too-much-included")
UNKNOWN_BASE = error("RC295", "unknown-base")
EXTENDS_CYCLE = error("RC296", "extends-cycle")
