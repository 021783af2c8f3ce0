"""Commands import only what they need."""

from __future__ import annotations

import subprocess
import sys

CODE = "import sys, composer.client.systems.process_list; sys.exit('numpy' in sys.modules)"


def test_listing_processes_does_not_import_numpy() -> None:
    """It would take longer than the rest of the command."""
    assert subprocess.run([sys.executable, "-c", CODE], check=False).returncode == 0
