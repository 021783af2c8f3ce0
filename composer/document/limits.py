"""Limits for the size of files.

They allow any file written by hand and generated systems of 10 000 nodes. A file
beyond a limit is refused within about one second and 200 MB.
"""

from __future__ import annotations

#: Bytes in a file; checked before it is read.
MAX_BYTES = 2_000_000

#: Nesting depth of maps and lists.
MAX_DEPTH = 32

#: Keys, values, maps and lists in a file, counting values repeated by aliases again.
MAX_VALUES = 250_000

#: Copies made by all ``for_each`` of one file.
MAX_COPIES = 10_000

#: Files that a system includes, counting each include.
MAX_INCLUDES = 5_000

#: Keys, values, maps and lists in all files that a system includes, again for each include.
MAX_INCLUDED_VALUES = 200_000

#: Node names that the patterns of a system stand for.
MAX_MATCHES = 50_000

#: Nesting depth of includes.
MAX_INCLUDE_DEPTH = 16

#: Characters of a number.
MAX_NUMBER_LENGTH = 100

#: The range of ROS integers: int64 and uint64.
MIN_INTEGER = -(2**63)
MAX_INTEGER = 2**64 - 1
