from __future__ import annotations

import pytest

from composer.base import resources


@pytest.mark.parametrize(
    ("folder", "member"),
    [
        (resources.nodes_folder(), "planner.yaml"),
        (resources.systems_folder(), "pipeline.yaml"),
        (resources.interfaces_folder(), "package.xml"),
        (resources.schemas_folder(), "system.schema.json"),
    ],
)
def test_a_folder_is_where_its_files_are(folder, member) -> None:
    assert (folder / member).is_file()


def test_the_share_folder_of_a_wheel_wins_over_folders_next_to_the_package(
    tmp_path, monkeypatch
) -> None:
    package = tmp_path / "site-packages" / "composer"
    for folder in (package / "share" / "nodes", package.parent / "nodes"):
        folder.mkdir(parents=True)
    monkeypatch.setattr(resources, "_PACKAGE", package)

    assert resources.nodes_folder() == package / "share" / "nodes"
