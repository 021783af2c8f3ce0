"""What a node asks of each of its ports and timers."""

from __future__ import annotations

from typing import Protocol

from rclpy.callback_groups import CallbackGroup, ReentrantCallbackGroup

from composer.model import Port
from composer.runtime.callbacks.context import NodeContext


class RunningPort(Protocol):
    """A port or timer between the configuration and the clean-up of its node."""

    def activate(self) -> None:
        """Begin: the node is active now."""

    def deactivate(self) -> None:
        """Take nothing more and give up what waits: the node is leaving *active*."""

    def destroy(self) -> None:
        """Give back everything."""


def callback_group(core: NodeContext, port: Port) -> CallbackGroup:
    """Return the callback group of the port: the one all ports of its node share, if it may."""
    return ReentrantCallbackGroup() if port.reentrant else core.group
