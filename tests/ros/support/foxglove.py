"""The published npm client of the Foxglove protocol, in a process of its own."""

from __future__ import annotations

import json
import queue
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.ros.support.dashboard import PATIENCE_S, Address

FOLDER = Path(__file__).parents[2] / "foxglove"


def url_of(address: Address) -> str:
    """Return the address for Foxglove."""
    return f"ws://{address.host}/foxglove?token={address.token}"


class FoxgloveClient:
    """Sends commands to ``tests/foxglove/client.mjs`` and reads its events."""

    def __init__(self, url: str, subprotocol: str) -> None:
        self._process = subprocess.Popen(
            ["node", "client.mjs", url, subprotocol],
            cwd=FOLDER,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.events: list[tuple[str, Any]] = []
        self._new: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._new.put(line)

    def do(self, command: str, **values: Any) -> None:
        """Send a command."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": command, **values}) + "\n")
        self._process.stdin.flush()

    def until(
        self, event: str, fits: Callable[[Any], Any] = lambda _: True, within_s: float = PATIENCE_S
    ) -> Any:
        """Return the data of the first such event, from now or before, that fits."""
        end_s = time.monotonic() + within_s
        position = 0
        while True:
            for found, data in self.events[position:]:
                if found == event and fits(data):
                    return data
            position = len(self.events)
            left_s = end_s - time.monotonic()
            try:
                content = json.loads(self._new.get(timeout=max(left_s, 0.0)))
            except queue.Empty:
                raise AssertionError(f"no such {event}, last: {self._last()}") from None
            self.events.append((content["event"], content.get("data")))

    def has(self, topic: str) -> int:
        """Wait until a topic is advertised; return the id of its channel."""

        def channels(found: Any) -> list[Any]:
            return [item["id"] for item in found if item["topic"] == topic]

        identifier: int = channels(self.until("advertise", channels))[0]
        return identifier

    def message(
        self, topic: str, fits: Callable[[Any], Any] = lambda _: True, within_s: float = PATIENCE_S
    ) -> Any:
        """Return the first message of a topic whose value fits."""
        return self.until(
            "message", lambda data: data["topic"] == topic and fits(data["value"]), within_s
        )

    def _last(self) -> str:
        return str([event for event in self.events if event[0] != "message"][-8:])[:3000]

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        self._process.wait(timeout=PATIENCE_S)


@contextmanager
def foxglove(address: Address, subprotocol: str = "foxglove.sdk.v1") -> Iterator[FoxgloveClient]:
    """Connect for the length of the block."""
    client = FoxgloveClient(url_of(address), subprotocol)
    try:
        yield client
    finally:
        client.close()
