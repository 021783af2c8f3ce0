from __future__ import annotations

from composer.base import resources


def test_the_share_folder_of_a_wheel_wins_over_folders_next_to_the_package(
    tmp_path, monkeypatch
) -> None:
    package = tmp_path / "site-packages" / "composer"
    for folder in (package / "share" / "nodes", package.parent / "nodes"):
        folder.mkdir(parents=True)
    monkeypatch.setattr(resources, "PACKAGE", package)

    assert resources.nodes_folder() == package / "share" / "nodes"
