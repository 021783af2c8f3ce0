"""How behaviors use the API."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.python_checks import check, problems

FILES = [
    """
    class Robot:
        async def on_tick(self):
            sent = await self.action_clients.count.send_goal(None)
            outcome = await sent.result()
            if outcome.status == "success":  # VALUE?
                return
            if outcome.status == "succeeded" or sent.status == "success":
                return
            if self.parameters.mode == "slow":
                return
            if "fats" != self.parameters.mode or self.parameters.mode == "fats":  # VALUE?
                return
            if self.parameters.frame == "fats":
                return
    """,
    """
    class Robot:
        def __init__(self):
            self.limit = self.parameters.limit  # EARLY
            self.log.info("started")
    """,
    """
    class Robot:
        def __init__(self):
            self.reset()

        def reset(self):
            self.start_s = self.clock.now()  # EARLY
    """,
    """
    class Robot:
        def __init__(self, log):
            self.log = log
            self.log.info("started")
            self.later = lambda: self.parameters.limit
    """,
    """
    class Robot:
        def __init__(self):
            if hasattr(self, "clock"):
                self.start_s = self.clock.now()
    """,
    """
    class Robot:
        def clock(self):
            return 0.0

        def __init__(self):
            self.start_s = self.clock()
    """,
    """
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
    """,
    """
    class Robot:
        is_active = False

        def on_configure(self):
            self.update()

        def update(self):
            if self.is_active:
                self.publishers.velocity.publish(None)
    """,
    """
    import asyncio

    class Robot:
        async def on_tick(self):
            await asyncio.sleep(0.5)  # ASYNCIO
            await asyncio.sleep(0)
            await self.clock.sleep(1.0)
            await self.transforms.wait("a", "b")
            await self.other.now()
    """,
    """
    import asyncio
    import threading

    class Robot:
        def on_activate(self):
            threading.Thread(target=lambda: asyncio.run(self.serve())).start()

        async def serve(self):
            await asyncio.sleep(0.5)
    """,
    """
    class Robot:
        def on_tick(self):
            self.parameters["limt"]  # PORT
            self.parameters["limit"]
            self.publishers["velocities"].publish(None)  # PORT
            self.publishers["velocity"].publish(None)
            self.clients["velocity"]  # PORT
            self.other["limt"]
            self.parameters[self.name]
    """,
    """
    class Robot:
        async def on_tick(self):
            goal = await self.action_clients.count.send_goal(None, on_feedback=self.show)
            await self.action_clients.count.send_goal(None, on_feedback=lambda: 1)
            await self.action_clients.count.send_goal(None, on_feedback=lambda feedback: 1)

        def show(self, name, feedback):
            pass
    """,
    """
    class Robot:
        def other(this, value):
            return value

        @staticmethod
        def plain():
            return 1

        async def on_fibonacci(self, goal):
            return None
    """,
]


@pytest.mark.parametrize("text", FILES)
def test_behaviors(text: str, tmp_path: Path) -> None:
    check(text, tmp_path, "behavior")


def test_texts(tmp_path: Path) -> None:
    text = """
    class Robot:
        def on_configure(self):
            self.publishers.velocity.publish(self.parameters["limt"])
    """
    assert {(item.message, item.hint) for item in problems(text, tmp_path, "behavior")} == {
        (
            "'on_configure' runs while the node is not active: the message is dropped",
            "move it to on_activate",
        ),
        ("the node has no parameter 'limt'", "did you mean 'limit'?"),
    }
