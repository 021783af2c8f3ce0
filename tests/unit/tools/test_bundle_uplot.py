"""What the dashboard has from npm: pinned, and with its license."""

from __future__ import annotations

import pytest

from tools.bundle_uplot import FILES, FOLDER, ROOT, VERSION, unpacked


def test_another_archive_is_refused() -> None:
    with pytest.raises(SystemExit, match="expected"):
        unpacked(b"something else")


def test_the_bundled_files_are_of_the_pinned_version() -> None:
    assert {path.name for path in FOLDER.iterdir()} == {path.rpartition("/")[2] for path in FILES}
    assert f"(v{VERSION})" in (FOLDER / "uPlot.esm.js").read_text(encoding="utf-8")[:400]


def test_the_license_is_listed() -> None:
    listed = (ROOT / "THIRD_PARTY.md").read_text(encoding="utf-8")
    assert VERSION in listed
    assert str((FOLDER / "LICENSE").relative_to(ROOT)) in listed
