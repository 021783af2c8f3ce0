"""How large a file may be.

Every limit is beyond what a person writes, and beyond a generated system of 2000 nodes and 6000
connections. What exceeds one is refused within about a second and 200 MB.
"""

from __future__ import annotations

#: Bytes in a file; looked at before anything is read.
MAX_BYTES = 2_000_000

#: Maps and lists inside each other.
MAX_DEPTH = 32

#: Keys, values, maps and lists in a file, those repeated by aliases counted again.
MAX_VALUES = 250_000

#: Copies that the ``for_each`` of one file make.
MAX_COPIES = 2_000

#: Files that a system includes, those counted again that are included again.
MAX_INCLUDES = 500

#: Keys, values, maps and lists in all files that a system includes, and in what patterns stand for.
MAX_INCLUDED_VALUES = 50_000

#: Files that include each other, one in another.
MAX_INCLUDE_DEPTH = 16

#: Characters of a number.
MAX_NUMBER_LENGTH = 100

#: The integers that some ROS type can hold: int64 and uint64.
MIN_INTEGER = -(2**63)
MAX_INTEGER = 2**64 - 1
