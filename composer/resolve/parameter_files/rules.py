"""The rules that reading parameter files checks."""

from __future__ import annotations

from composer.diagnostics import error, warning

PARAMETER_FILE = error("RC043", "parameter-file")
DUPLICATE_PARAMETER = warning("RC046", "duplicate-parameter")
PARAMETER_SUBSTITUTION = warning("RC045", "parameter-substitution")
