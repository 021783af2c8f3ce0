"""How behaviors use the API."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.python_checks import check

#: Files, separated by lines of dashes.
FILES = """\
class Robot:
    def __init__(self):
        self.limit = self.parameters.limit  # EARLY
        self.log.info("started")
---
class Robot:
    def __init__(self):
        self.reset()
    def reset(self):
        self.start_s = self.clock.now()  # EARLY
---
class Robot:
    def __init__(self, log):
        self.log = log
        self.log.info("started")
        self.later = lambda: self.parameters.limit
---
class Robot:
    def __init__(self):
        if hasattr(self, "clock"):
            self.start_s = self.clock.now()
---
class Robot:
    def clock(self):
        return 0.0
    def __init__(self):
        self.start_s = self.clock()
---
class Robot:
    async def on_configure(self):
        self.publishers.velocity.publish(None)  # EARLY?
        self.publishers.heartbeat.publish(None)
        publisher = self.publishers.velocity
        publisher.publish(None)  # EARLY?
        await self.clients.enable.call(None)  # EARLY
        await self.action_clients.count.send_goal(None)  # EARLY
        await self.clock.sleep(1.0)
        self.later = lambda: self.publishers.velocity.publish(None)
    def on_cleanup(self):
        self.stop()
    def stop(self):
        self.publishers.velocity.publish(None)  # EARLY?
    def on_activate(self):
        self.publishers.velocity.publish(None)
    def on_deactivate(self):
        self.publishers.velocity.publish(None)
---
class Robot:
    is_active = False
    def on_configure(self):
        self.update()
    def update(self):
        if self.is_active:
            self.publishers.velocity.publish(None)
---
import asyncio

class Robot:
    async def on_tick(self):
        await asyncio.sleep(0.5)  # ASYNCIO
        await asyncio.sleep(0)
        await self.clock.sleep(1.0)
        await self.transforms.wait("a", "b")
        await self.other.now()
---
import asyncio
import threading

class Robot:
    def on_activate(self):
        threading.Thread(target=lambda: asyncio.run(self.serve())).start()
    async def serve(self):
        await asyncio.sleep(0.5)
---
class Robot:
    async def on_tick(self):
        goal = await self.action_clients.count.send_goal(None, on_feedback=self.show)
        await self.action_clients.count.send_goal(None, on_feedback=lambda: 1)
        await self.action_clients.count.send_goal(None, on_feedback=lambda feedback: 1)
    def show(self, name, feedback):
        pass
---
class Robot:
    def other(this, value):
        return value
    @staticmethod
    def plain():
        return 1
    async def on_fibonacci(self, goal):
        return None
"""


@pytest.mark.parametrize("text", FILES.split("---\n"))
def test_behaviors(text: str, tmp_path: Path) -> None:
    check(text, tmp_path, "behavior")
