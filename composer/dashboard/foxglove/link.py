"""What every part of a client's connection uses: to send, to run feeds, and to make requests."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from composer.base.fast_dataclass import dataclass
from composer.dashboard.client import MAX_PENDING, POLICY_VIOLATION, Client
from composer.dashboard.feeds import Feed, Receiver
from composer.dashboard.foxglove.frames import ERROR, WARNING, status
from composer.dashboard.protocol.messages import RequestError, internal_error, to_json
from composer.dashboard.protocol.outbox import Outbox, Update

if TYPE_CHECKING:
    from composer.client.session import Deadline
    from composer.dashboard.ros_side import RosGraphSide

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Running:
    """A feed that a client receives."""

    key: str
    receiver: Receiver


class Link(Client):
    """The connection of one client of the protocol, without what it requests."""

    @property
    def outbox(self) -> Outbox:
        """What waits to be sent."""
        return self._outbox

    @property
    def is_read_only(self) -> bool:
        """Whether a client may change nothing."""
        return self._dashboard.options.read_only

    def check_may_change(self, what: str) -> None:
        """Raise RequestError if the dashboard is read-only."""
        if self.is_read_only:
            raise RequestError("read_only", f"{what} is not possible: the dashboard is read-only")

    def post(self, content: dict[str, Any] | bytes) -> None:
        """Send something that must not get lost; a client that does not read is disconnected."""
        if not self._outbox.is_full_of_replies:
            self._outbox.reply(content if isinstance(content, bytes) else to_json(content))
        elif self._is_open:
            self._is_open = False
            self._spawn(partial(self._close, POLICY_VIOLATION, "messages are not read"))

    def _refuse(self, error: RequestError) -> None:
        self.say(ERROR, error_text(error))

    def say(self, level: int, message: str) -> None:
        """Send a message for the user of the client."""
        self.post(status(level, message))

    def say_error(self, update: Update) -> None:
        """Send the error of a feed."""
        error = json.loads(update.data)
        self.say(WARNING, error_text(RequestError(error["code"], error["message"], error["hint"])))

    def start(self, name: str, feed: Feed, take: Callable[[Update], None]) -> Running:
        """Run a feed, which clients share under this name if it can be shared."""
        key = f"foxglove {name}" if feed.is_shared else f"foxglove {name} {id(self)}"
        running = Running(key, self._receiver(take))
        self._dashboard.feeds.add(key, feed, running.receiver)
        return running

    def poll_soon(self, running: Running) -> None:
        """Poll a feed at once."""
        self._dashboard.feeds.poll_soon(running.key)

    def stop(self, running: Running) -> None:
        """Receive a feed no longer."""
        self._dashboard.feeds.remove(running.key, running.receiver)

    def request(
        self,
        run: Callable[[RosGraphSide, Deadline], T],
        timeout_s: float,
        done: Callable[[T], None],
        fail: Callable[[RequestError], None],
    ) -> None:
        """Run something on a worker thread; ``done`` or ``fail`` answer.

        Raises RequestError if too many requests of this client run.
        """
        if len(self._pending) >= MAX_PENDING:
            raise RequestError("busy", f"{MAX_PENDING} of your requests are running already")

        async def answer() -> None:
            try:
                done(await self._dashboard.ros.call(run, timeout_s))
            except RequestError as error:
                fail(error)
            except Exception as error:  # the client gets an answer in any case
                fail(internal_error("a request", error))

        self._spawn(answer, self._size)


def error_text(error: RequestError) -> str:
    """Return an error with its hint."""
    return f"{error} ({error.hint})" if error.hint else str(error)
