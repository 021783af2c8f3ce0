"""``python -m composer`` is ``compose``."""

from __future__ import annotations

import sys

from composer.cli import main

if __name__ == "__main__":
    sys.exit(main())
