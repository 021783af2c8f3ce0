"""Opens bags of any form."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import TYPE_CHECKING, BinaryIO
from weakref import finalize

from composer.bags.bag import Bag, BagError, reading, require

if TYPE_CHECKING:
    from composer.bags.mcap_bag import McapBag
    from composer.bags.sqlite_bag import SqliteBag

#: The suffix of a file that rosbag2 has compressed, with ``--compression-mode file``.
_COMPRESSED = ".zstd"
#: How many times larger than itself a compressed file may be. A few kilobytes could fill the disk.
_MOST_TIMES = 1000
_BLOCK_BYTES = 2**20


def open_bag(path: Path) -> Bag:
    """Return the bag of a folder or a file: MCAP, or sqlite3 as rosbag2 writes it.

    Raises BagError.
    """
    if not path.exists():
        raise BagError(f"there is no bag {path}")
    files = _files(path)
    if not files:
        raise BagError(f"{path} is not a bag: it has neither .mcap nor .db3 files")
    if files[0].suffix == _COMPRESSED:
        return _decompressed(path, files)
    return _open(path, files)


def _decompressed(path: Path, files: tuple[Path, ...]) -> Bag:
    """Return a bag whose files are compressed as a whole; they are decompressed until its end."""
    require("zstandard")
    import zstandard  # noqa: PLC0415 - an extra

    folder = Path(mkdtemp(prefix="compose-bag-"))
    try:
        plain = []
        for file in files:
            plain.append(folder / file.stem)
            with reading(file), file.open("rb") as source, plain[-1].open("wb") as target:
                blocks = zstandard.ZstdDecompressor().read_to_iter(source, write_size=_BLOCK_BYTES)
                _write(blocks, target, file)
        bag = _open(path, tuple(plain))
    except BaseException:
        rmtree(folder, ignore_errors=True)
        raise
    bag.files = [str(file) for file in files]
    finalize(bag, rmtree, folder, ignore_errors=True)
    return bag


def _write(blocks: Iterable[bytes], target: BinaryIO, file: Path) -> None:
    """Write what ``file`` contains. Raises BagError if that is too much."""
    size, most = 0, file.stat().st_size * _MOST_TIMES
    for block in blocks:
        size += target.write(block)
        if size > most:
            raise BagError(f"{file} contains more than {_MOST_TIMES:,} times its size")


def _open(path: Path, files: tuple[Path, ...]) -> McapBag | SqliteBag:
    if files[0].suffix == ".mcap":
        require("mcap")
        from composer.bags.mcap_bag import McapBag  # noqa: PLC0415 - an extra

        return McapBag(files)
    require("rosbags")
    from composer.bags.sqlite_bag import SqliteBag  # noqa: PLC0415 - an extra

    return SqliteBag(path, files)


def _files(path: Path) -> tuple[Path, ...]:
    if path.is_file():
        if path.name.removesuffix(_COMPRESSED).endswith((".mcap", ".db3")):
            return (path,)
        raise BagError(f"{path} is not a bag: expected a folder, or a .mcap or .db3 file")
    if not path.is_dir():
        raise BagError(f"{path} is neither a file nor a folder")
    try:
        names = sorted(path.iterdir())
    except OSError as error:
        raise BagError(f"cannot read {path}: {error.strerror}") from error
    for pattern in ("*.mcap", "*.db3", f"*.mcap{_COMPRESSED}", f"*.db3{_COMPRESSED}"):
        found = tuple(name for name in names if name.match(pattern) and name.is_file())
        if found:
            return found
    return ()
