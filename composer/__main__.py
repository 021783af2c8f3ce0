"""``python -m composer`` is ``compose``."""

from __future__ import annotations

import sys

if __name__ == "__main__":
    if not sys.flags.safe_path:
        # Python puts the current folder first, where a signal.py would replace the library's.
        del sys.path[0]
    from composer.cli import run

    sys.exit(run())
