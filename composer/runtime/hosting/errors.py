"""What a hosted class cannot do."""

from __future__ import annotations

from composer.behavior import TransitionFailed


class HostingError(TransitionFailed):
    """A class cannot be hosted; the text says why, and what to do instead.

    It fails the transition, without a traceback: the reason is not a mistake in the class.
    """
