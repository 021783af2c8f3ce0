"""The transforms that a process has received, and lookups between any two frames."""

from __future__ import annotations

import math
import threading
from bisect import bisect_left
from collections.abc import Callable
from typing import NamedTuple

from composer.base.diagnostics import suggestion
from composer.base.fast_dataclass import dataclass
from composer.behavior import (
    TransformConnectivityError,
    TransformError,
    TransformExtrapolationError,
    TransformLookupError,
)
from composer.model.transforms import IDENTITY, Transform, compose, interpolate, inverse, is_unit

#: As in tf2.
HISTORY_NS = 10_000_000_000
_NANOSECONDS = 1e9


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


class Found(NamedTuple):
    """A transform that was looked up, and its time; zero if it only consists of static ones."""

    stamp_ns: int
    transform: Transform


class TransformBuffer:
    """A tree of frames, as tf2 keeps it. Thread-safe.

    A lookup goes from both frames up to their common ancestor. Without a time, it uses the latest
    time for which all transforms on the way are known.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: dict[str, StaticHistory | DynamicHistory] = {}  # by child
        self._roots: dict[str, None] = {}  # parents, some of which are children as well
        self._waiting: dict[Callable[[], None], None] = {}

    def insert(
        self, parent: str, child: str, stamp_ns: int, transform: Transform, *, static: bool
    ) -> str | None:
        """Add a transform. Return why it is not valid, or None."""
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        problem = _problem(parent, child, transform)
        if problem is not None:
            return problem
        sample = Sample(parent, transform)
        with self._lock:
            self._roots[parent] = None
            if static:
                self._frames[child] = StaticHistory(sample)
                return None
            history = self._frames.get(child)
            if not isinstance(history, DynamicHistory):
                history = self._frames[child] = DynamicHistory()
            if not history.insert(stamp_ns, sample):
                age_s = (history.latest_ns - stamp_ns) / _NANOSECONDS
                return f"it is {age_s:.3f} s older than the latest one"
        return None

    def clear(self) -> None:
        """Forget all transforms that change; static ones stay valid at any time."""
        with self._lock:
            self._frames = {
                child: history
                for child, history in self._frames.items()
                if isinstance(history, StaticHistory)
            }
            self._roots = dict.fromkeys(item.latest.parent for item in self._frames.values())

    def lookup(self, target: str, source: str, stamp_ns: int | None) -> Found:
        """Return the transform from ``source`` to ``target``; None is the latest time.

        Raises TransformLookupError, TransformConnectivityError, TransformExtrapolationError.
        """
        found = self.find(target, source, stamp_ns)
        if isinstance(found, TransformError):
            raise self.explained(found, target, source)
        return found

    def find(self, target: str, source: str, stamp_ns: int | None) -> Found | TransformError:
        """Return the transform, or why it is not available, without a hint: that takes longer."""
        try:
            with self._lock:
                self._check(target)
                self._check(source)
                if stamp_ns is None:
                    stamp_ns = self._latest_common_ns(target, source)
                return Found(stamp_ns, self._transform(target, source, stamp_ns))
        except TransformError as error:
            return error

    def explained(self, error: TransformError, target: str, source: str) -> TransformError:
        """Return the error of a lookup with a hint, if a frame is not known."""
        if not isinstance(error, TransformLookupError):
            return error
        with self._lock:
            known = {*self._frames, *self._roots}
        unknown = next((frame for frame in (target, source) if frame not in known), None)
        if unknown is None:  # it is known by now
            return error
        hint = suggestion(unknown, known) or "no transform was received yet"
        if unknown.startswith("/"):
            hint = "a frame ID does not begin with a slash"
        return TransformLookupError(f"{error}; {hint}")

    def add_waiting(self, retry: Callable[[], None]) -> None:
        """Call ``retry`` after each message until it is removed."""
        with self._lock:
            self._waiting[retry] = None

    def remove_waiting(self, retry: Callable[[], None]) -> None:
        """Do not call ``retry`` again."""
        with self._lock:
            self._waiting.pop(retry, None)

    def notify(self) -> None:
        """Let those that wait look up again: transforms were added."""
        if self._waiting:
            with self._lock:
                waiting = tuple(self._waiting)
            for retry in waiting:
                retry()

    def _check(self, frame: str) -> None:
        if frame in self._frames or frame in self._roots:
            return
        raise TransformLookupError(f"frame '{frame}' is not known")

    def _latest_common_ns(self, target: str, source: str) -> int:
        """Return the latest time for which all transforms between two frames are known."""
        if target == source:
            limit = _limit(self._frames.get(source))
            return 0 if limit == math.inf else int(limit)
        latest = math.inf
        above: dict[str, float] = {}  # from the source up: the time that limits the way until there
        for frame, history in self._way_up(source):
            above[frame] = latest
            latest = min(latest, _limit(history))
        latest = math.inf
        for frame, history in self._way_up(target):
            if frame in above:
                common = min(latest, above[frame])
                return 0 if common == math.inf else int(common)
            latest = min(latest, _limit(history))
        raise self._unconnected(target, source)

    def _way_up(self, frame: str) -> list[tuple[str, StaticHistory | DynamicHistory | None]]:
        """Return the frame and its ancestors by the latest transforms, each with its history."""
        way: list[tuple[str, StaticHistory | DynamicHistory | None]] = []
        seen = set()
        while frame not in seen:
            seen.add(frame)
            history = self._frames.get(frame)
            way.append((frame, history))
            if history is None:
                break
            frame = history.latest.parent
        return way

    def _transform(self, target: str, source: str, stamp_ns: int) -> Transform:
        in_ancestors: dict[str, Transform] = {}
        transform, frame, outside = IDENTITY, source, None
        while frame not in in_ancestors:
            in_ancestors[frame] = transform
            if frame == target:
                return transform
            sample, outside = self._at(frame, stamp_ns)
            if sample is None:
                break
            transform, frame = compose(sample.transform, transform), sample.parent
        source_outside, seen = outside, set()
        transform, frame = IDENTITY, target
        while frame not in seen:
            seen.add(frame)
            if frame in in_ancestors:
                return compose(inverse(transform), in_ancestors[frame])
            sample, outside = self._at(frame, stamp_ns)
            if sample is None:
                break
            transform, frame = compose(sample.transform, transform), sample.parent
        for problem in (source_outside, outside):
            if problem is not None:
                raise _extrapolation(target, source, stamp_ns, *problem)
        raise self._unconnected(target, source)

    def _at(
        self, frame: str, stamp_ns: int
    ) -> tuple[Sample | None, tuple[str, OutsideHistory] | None]:
        """Return the transform of a frame at a time, or why there is none."""
        history = self._frames.get(frame)
        if history is None:
            return None, None
        try:
            return history.at(stamp_ns), None
        except OutsideHistory as error:
            return None, (frame, error)

    def _unconnected(self, target: str, source: str) -> TransformError:
        target_root, source_root = self._way_up(target)[-1][0], self._way_up(source)[-1][0]
        return TransformConnectivityError(
            f"frames '{target}' and '{source}' are not connected: their trees begin at "
            f"'{target_root}' and '{source_root}'"
        )


def _limit(history: StaticHistory | DynamicHistory | None) -> float:
    latest_ns = None if history is None else history.latest_ns
    return math.inf if latest_ns is None else latest_ns


def _problem(parent: str, child: str, transform: Transform) -> str | None:
    """Return why tf2 would ignore a transform, or None."""
    if not parent or not child:
        return "the parent has no name" if not parent else "the frame has no name"
    if parent == child:
        return "the frame is its own parent"
    if not all(map(math.isfinite, (*transform.translation, *transform.rotation))):
        return "a value is not finite"
    if not is_unit(transform.rotation):
        return "the rotation is not a unit quaternion"
    return None


def _extrapolation(
    target: str, source: str, stamp_ns: int, frame: str, error: OutsideHistory
) -> TransformExtrapolationError:
    earliest, latest = seconds(error.earliest_ns), seconds(error.latest_ns)
    known = f"from {earliest} to {latest}"
    if error.earliest_ns == error.latest_ns:
        known = f"only at {latest}"
    relation = "later" if stamp_ns > error.latest_ns else "earlier"
    return TransformExtrapolationError(
        f"no transform from '{source}' to '{target}' at {seconds(stamp_ns)}: the transform from "
        f"'{frame}' to '{error.parent}' is known {known}, and the time is {relation}"
    )


def seconds(stamp_ns: int) -> str:
    """Return a time for messages."""
    return f"{stamp_ns // 1_000_000_000}.{stamp_ns % 1_000_000_000 // 1_000_000:03d} s"
