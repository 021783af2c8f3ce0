"""Opens bags of any form."""

from __future__ import annotations

from pathlib import Path

from composer.bags.bag import Bag, BagError, require


def open_bag(path: Path) -> Bag:
    """Return the bag of a folder or a file: MCAP, or sqlite3 as rosbag2 writes it.

    Raises BagError.
    """
    if not path.exists():
        raise BagError(f"there is no bag {path}")
    files = _files(path)
    if not files:
        raise BagError(f"{path} is not a bag: it has neither .mcap nor .db3 files")
    if files[0].suffix == ".mcap":
        require("mcap")
        from composer.bags.mcap_bag import McapBag  # noqa: PLC0415 - an extra

        return McapBag(files)
    require("rosbags")
    from composer.bags.sqlite_bag import SqliteBag  # noqa: PLC0415 - an extra

    return SqliteBag(path, files)


def _files(path: Path) -> tuple[Path, ...]:
    if path.is_file():
        if path.suffix not in (".mcap", ".db3"):
            raise BagError(f"{path} is not a bag: expected a folder, or a .mcap or .db3 file")
        return (path,)
    try:
        names = sorted(path.iterdir())
    except OSError as error:
        raise BagError(f"cannot read {path}: {error.strerror}") from error
    for pattern in ("*.mcap", "*.db3*"):
        found = tuple(name for name in names if name.match(pattern) and name.is_file())
        if found:
            return found
    return ()
