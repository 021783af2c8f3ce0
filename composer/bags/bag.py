"""What a bag contains: topics, messages, attachments."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple, Protocol

from composer.base.fast_dataclass import dataclass
from composer.model.qos import QosProfile

NANOSECONDS = 1_000_000_000
#: What Python needs for a message in memory, in addition to its data.
_BYTES_PER_MESSAGE = 200
#: How ROS 2 serializes messages.
CDR = "cdr"


class BagError(Exception):
    """A bag cannot be read or written; ``hint`` says how to proceed."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True, slots=True)
class BagTopic:
    """A topic of a bag.

    ``qos`` are the profiles that its publishers offered. ``definition`` is the text of the message
    and of all messages in it, in ``encoding``; empty if it is not known. ``message_encoding`` is
    ``cdr``, except in bags of other programs than ROS 2.
    """

    name: str
    type_name: str
    qos: tuple[QosProfile, ...] = ()
    definition: str = ""
    encoding: str = "ros2msg"
    type_hash: str = ""
    message_encoding: str = CDR


class BagMessage(NamedTuple):
    """A serialized message. Times are nanoseconds since 1970."""

    topic: str
    recorded_ns: int
    published_ns: int
    data: bytes

    @property
    def memory_bytes(self) -> int:
        """What it takes in memory, about."""
        return len(self.data) + _BYTES_PER_MESSAGE


class Attachment(NamedTuple):
    """A file in a bag."""

    name: str
    media_type: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Summary:
    """The topics of a bag, with the number of messages of each, and the times of its messages.

    ``end_ns`` is the time of the last message. Both times are 0 for a bag without messages.
    """

    topics: Mapping[str, BagTopic]
    counts: Mapping[str, int]
    start_ns: int
    end_ns: int

    @property
    def duration_s(self) -> float:
        """The seconds between the first and the last message."""
        return (self.end_ns - self.start_ns) / NANOSECONDS


class Bag(Protocol):
    """A bag to read."""

    @property
    def summary(self) -> Summary:
        """What is in it."""

    @property
    def files(self) -> Sequence[str]:
        """The paths of its files."""

    @property
    def warnings(self) -> Sequence[str]:
        """What is missing in it, as the end of a file that was cut off."""

    def messages(self, topics: frozenset[str], start_ns: int, end_ns: int) -> Iterator[BagMessage]:
        """Yield the messages of these topics from ``start_ns`` to before ``end_ns``, in order.

        Raises BagError for a corrupt file.
        """

    def attachments(self) -> Iterator[Attachment]:
        """Yield the attached files. Raises BagError for a corrupt file."""


def joined(summaries: Iterable[Summary]) -> Summary:
    """Return the summary of a bag of several files."""
    topics: dict[str, BagTopic] = {}
    counts = Counter[str]()
    parts = list(summaries)
    for part in parts:
        topics |= part.topics
        counts.update(part.counts)
    timed = [part for part in parts if sum(part.counts.values())]
    start_ns = min((part.start_ns for part in timed), default=0)
    return Summary(topics, counts, start_ns, max((part.end_ns for part in timed), default=0))


def full_type_name(name: str) -> str:
    """Return the name of a message type as in ROS 2. ROS 1 writes ``std_msgs/String``."""
    return name.replace("/", "/msg/") if name.count("/") == 1 else name


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what a library raises for a file into BagError; it may raise almost anything."""
    try:
        yield
    except BagError:
        raise
    except OSError as error:
        raise BagError(f"cannot read {path}: {error.strerror or error}") from error
    except Exception as error:
        text = str(error) or type(error).__name__
        raise BagError(f"{path} is corrupt or not supported: {text}") from error


def require(library: str) -> None:
    """Raise BagError if a library of the extra ``bags`` is not installed."""
    if find_spec(library) is None:
        raise BagError(
            f"bags need '{library}', which is not installed in this Python",
            'pip install "ros2-composer[bags]"',
        )
