"""Stable identities of diagnostics, independent of changes around them."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable

from composer.diagnostics import Diagnostic


def fingerprints(diagnostics: Iterable[Diagnostic]) -> list[str]:
    """Return a stable hexadecimal fingerprint for each diagnostic, in order.

    It is made from the rule, the file, the message and the line without its indentation, so added
    lines and other indentation do not change it. Diagnostics that are equal in all of these are
    numbered.
    """
    seen: Counter[tuple[str, ...]] = Counter()
    result = []
    for diagnostic in diagnostics:
        span = diagnostic.primary
        text = span.file.line(span.line).strip()
        facts = (diagnostic.rule.code, span.file.path, diagnostic.message, text)
        seen[facts] += 1
        content = "\0".join((*facts, str(seen[facts])))
        digest = hashlib.sha256(content.encode("utf-8", "surrogatepass"))
        result.append(digest.hexdigest()[:32])
    return result
