"""Random numbers and ids of a system: the same in each run that has a seed."""

from __future__ import annotations

import random
from uuid import UUID

_IDS = random.Random()  # noqa: S311 - they identify, and protect nothing


def use_seed(seed: int) -> None:
    """Begin the sequence of ids, of :mod:`random` and of ``numpy.random`` that ``seed`` has.

    Generators that user code has created, such as ``numpy.random.default_rng()``, have their own.
    """
    _IDS.seed(seed)
    random.seed(seed)
    import numpy as np  # noqa: PLC0415 - its random numbers are slow to load

    np.random.seed(seed)


def new_id() -> bytes:
    """Return the 16 bytes of a random UUID."""
    return UUID(int=_IDS.getrandbits(128), version=4).bytes
