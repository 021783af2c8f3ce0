"""What every part of a client's connection uses to send something."""

from __future__ import annotations

import json
from functools import partial
from typing import Any

from composer.dashboard.feeds import Feed
from composer.dashboard.foxglove.encoding import ERROR, WARNING, status
from composer.dashboard.protocol.messages import RequestError, to_json
from composer.dashboard.protocol.outbox import Outbox, Update
from composer.dashboard.web.client import POLICY_VIOLATION, Client, Running


class Link(Client):
    """The connection of one client of the protocol, without what it requests."""

    @property
    def outbox(self) -> Outbox:
        """What waits to be sent."""
        return self._outbox

    def post(self, content: dict[str, Any] | bytes) -> None:
        """Send something that must not get lost; a client that does not read is disconnected."""
        if not self._outbox.is_full_of_replies:
            self._outbox.reply(content if isinstance(content, bytes) else to_json(content))
        elif self._is_open:
            self._is_open = False
            self._spawn(partial(self._close, POLICY_VIOLATION, "messages are not read"))

    def say(self, level: int, message: str) -> None:
        """Send a message for the user of the client."""
        self.post(status(level, message))

    def refuse(self, error: RequestError) -> None:
        """Say why a request is refused."""
        self.say(ERROR, error_text(error))

    def say_error(self, update: Update) -> None:
        """Send the error of a feed."""
        error = json.loads(update.data)
        self.say(WARNING, error_text(RequestError(error["code"], error["message"], error["hint"])))

    def follow(self, name: str, feed: Feed, take: Any) -> Running:
        """Receive a feed, whose errors are said; ``take`` gets its other updates."""

        def receive(update: Update) -> None:
            if update.is_error:
                self.say_error(update)
            else:
                take(update)

        return self.start(f"foxglove {name}", feed, receive)


def error_text(error: RequestError | Any) -> str:
    """Return an error with its hint."""
    return f"{error} ({error.hint})" if error.hint else str(error)
