"""The transforms from one frame to its parent over the last seconds."""

from __future__ import annotations

from bisect import bisect_left
from typing import NamedTuple

from composer.base.fast_dataclass import dataclass
from composer.model.geometry import Transform, interpolate

#: As in tf2.
HISTORY_NS = 10_000_000_000


class Sample(NamedTuple):
    """The parent of a frame at one time, and the transform to it."""

    parent: str
    transform: Transform


class OutsideHistory(Exception):
    """A time is earlier or later than what is known, which is ``earliest_ns`` to ``latest_ns``."""

    def __init__(self, parent: str, earliest_ns: int, latest_ns: int) -> None:
        super().__init__(parent)
        self.parent = parent
        self.earliest_ns = earliest_ns
        self.latest_ns = latest_ns


@dataclass(slots=True)
class StaticHistory:
    """A transform that is valid at any time."""

    sample: Sample
    latest_ns: int | None = None  # it does not limit the times for which transforms are known

    @property
    def latest(self) -> Sample:
        """The transform."""
        return self.sample

    def at(self, _: int) -> Sample:
        """Return the transform."""
        return self.sample


class DynamicHistory:
    """Transforms by time, of the last ten seconds before the latest one."""

    __slots__ = ("_samples", "_times")

    def __init__(self) -> None:
        self._times: list[int] = []
        self._samples: list[Sample] = []

    @property
    def latest_ns(self) -> int:
        """The latest time."""
        return self._times[-1]

    @property
    def latest(self) -> Sample:
        """The latest transform."""
        return self._samples[-1]

    def insert(self, stamp_ns: int, sample: Sample) -> bool:
        """Add a transform, unless its time is known already. Return False if it is too old."""
        times = self._times
        if not times or stamp_ns > times[-1]:  # nearly always
            times.append(stamp_ns)
            self._samples.append(sample)
            self._forget(stamp_ns - HISTORY_NS)
            return True
        if stamp_ns < times[-1] - HISTORY_NS:
            return False
        place = bisect_left(times, stamp_ns)
        if times[place] != stamp_ns:
            times.insert(place, stamp_ns)
            self._samples.insert(place, sample)
        return True

    def at(self, stamp_ns: int) -> Sample:
        """Return the transform at a time, interpolated. Raises OutsideHistory."""
        times, samples = self._times, self._samples
        place = bisect_left(times, stamp_ns)
        if place < len(times) and times[place] == stamp_ns:
            return samples[place]
        if place in (0, len(times)):
            nearest = samples[min(place, len(times) - 1)]
            raise OutsideHistory(nearest.parent, times[0], times[-1])
        before, after = samples[place - 1], samples[place]
        if before.parent != after.parent:
            return before
        ratio = (stamp_ns - times[place - 1]) / (times[place] - times[place - 1])
        return Sample(before.parent, interpolate(before.transform, after.transform, ratio))

    def _forget(self, before_ns: int) -> None:
        times = self._times
        if times[0] < before_ns:
            count = bisect_left(times, before_ns)
            del times[:count], self._samples[:count]
