"""Service calls of commands: what only reads may be asked again, what changes something is not."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from typing import Any, TypeAlias

from rclpy.client import Client
from rclpy.task import Future

from composer.remote.session import Deadline, NoAnswer, Session

#: A server of rmw_fastrtps waits 0.1 s for a client that it has not met yet, as it may be with a
#: command, and then drops the answer; the client does not hear of it. By now they have met.
_ASK_AGAIN_AFTER_S = 1.0

#: How a request is sent: :func:`ask` or :func:`call_once`.
Send: TypeAlias = Callable[[Session, Any, str, Any, Deadline], Any]


class Asker:
    """Asks services. Making clients is what takes time, so they stay until ``close``.

    Who has not answered is asked again every ``again_after_s`` seconds: for what changes nothing.
    """

    def __init__(self, session: Session, again_after_s: float = _ASK_AGAIN_AFTER_S) -> None:
        self._session = session
        self._again_after_s = again_after_s
        self._clients: dict[str, Client] = {}

    def close(self) -> None:
        """Destroy all clients."""
        for client in self._clients.values():
            self._session.node.destroy_client(client)
        self._clients.clear()

    def ask(self, service: Any, requests: Mapping[str, Any], deadline: Deadline) -> dict[str, Any]:
        """Return the response of each service, None of those that did not answer in time."""
        questions = {
            name: _Question(self._client(service, name), request, self._again_after_s)
            for name, request in requests.items()
        }
        try:
            unanswered = list(questions.values())
            while unanswered and not deadline.passed:
                for question in unanswered:
                    question.send_when_due()
                self._session.spin_once(deadline)
                unanswered = [question for question in unanswered if question.response is None]
            return {name: question.response for name, question in questions.items()}
        finally:
            for question in questions.values():
                question.drop()

    def _client(self, service: Any, name: str) -> Client:
        if name not in self._clients:
            self._clients[name] = self._session.node.create_client(service, name)
        return self._clients[name]


def ask_each(
    session: Session, service: Any, names: Iterable[str], request: Any, deadline: Deadline
) -> dict[str, Any]:
    """Ask services of one type what changes nothing; None for those that did not answer in time."""
    with closing(Asker(session)) as asker:
        return asker.ask(service, dict.fromkeys(names, request), deadline)


def ask(session: Session, service: Any, name: str, request: Any, deadline: Deadline) -> Any:
    """Return what a service responds to a request that changes nothing. Raises NoAnswer."""
    with closing(Asker(session)) as asker:
        return _only_response(asker, service, name, request, deadline)


def call_once(session: Session, service: Any, name: str, request: Any, deadline: Deadline) -> Any:
    """Return what a service responds to a request that is sent once, whatever it does.

    Raises NoAnswer; the server may have done what was asked all the same.
    """
    with closing(Asker(session, again_after_s=math.inf)) as asker:
        return _only_response(asker, service, name, request, deadline)


def _only_response(asker: Asker, service: Any, name: str, request: Any, deadline: Deadline) -> Any:
    response = asker.ask(service, {name: request}, deadline)[name]
    if response is None:
        raise NoAnswer(f"service '{name}' did not answer within {deadline.timeout_s:g} s")
    return response


class _Question:
    """A request that is sent as soon as the server is there, and again until it is answered."""

    def __init__(self, client: Client, request: Any, again_after_s: float) -> None:
        self._client = client
        self._request = request
        self._again_after_s = again_after_s
        self._due_s = 0.0
        self._sent: list[Future] = []

    @property
    def response(self) -> Any:
        """The first response to have come, to whichever sending; None while there is none."""
        return next((future.result() for future in self._sent if future.done()), None)

    def send_when_due(self) -> None:
        """Send the request if it is time to, and if the server is there."""
        now_s = time.monotonic()
        if now_s >= self._due_s and self._client.service_is_ready():
            self._sent.append(self._client.call_async(self._request))
            self._due_s = now_s + self._again_after_s

    def drop(self) -> None:
        """Let what is still to come of responses be nobody's."""
        for future in self._sent:
            self._client.remove_pending_request(future)
