"""What a browser can request: one operation per entry, prepared on the event loop, run on a thread.

To add an operation, add a function that reads the request and returns what to run, and its line in
``OPERATIONS``.
"""

from __future__ import annotations

from composer.dashboard.operations.operation import Operation

OPERATIONS: dict[str, Operation] = {}
