from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.source import shown_path


def test_paths_are_shown_relative_to_where_one_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert shown_path(tmp_path / "nodes" / "a.yaml") == "nodes/a.yaml"
    assert shown_path(Path("/elsewhere/a.yaml")) == "/elsewhere/a.yaml"
