"""What makes a finding the same finding after the file around it has changed."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable

from composer.diagnostics import Diagnostic


def fingerprints(diagnostics: Iterable[Diagnostic]) -> list[str]:
    """Return a stable hexadecimal fingerprint for each finding, in order.

    Made of rule, file, message and the text of the line without its indentation: not of line or
    column, so that lines added above, or a deeper indentation, leave it as it is. Findings that
    are alike in all of these are told apart by counting.
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
