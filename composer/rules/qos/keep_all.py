"""An unbounded queue."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, info
from composer.model import ChannelKind
from composer.qos import History

RULE = info(
    code="RC314",
    name="keep-all",
    summary="A publisher or subscription keeps all messages.",
    why=(
        "If a subscription is slower than its publisher, the queue grows until memory runs "
        "out, or a reliable publisher blocks. Set a depth instead."
    ),
    bad="""\
system: queues
nodes:
  talker:
    publishers:
      chatter: {type: std_msgs/msg/String, qos: {history: keep_all}, external: true}
""",
    good="""\
system: queues
nodes:
  talker:
    publishers:
      chatter: {type: std_msgs/msg/String, qos: {history: keep_last, depth: 100}, external: true}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the history of every publisher and subscription; a shared profile is reported once."""
    for node in context.system.nodes:
        for port in node.ports:
            qos = port.qos
            if port.kind.channel is not ChannelKind.TOPIC or not qos.known:
                continue
            if qos.profile.history is History.KEEP_ALL:
                yield Diagnostic(
                    RULE,
                    "'keep_all' lets queues grow without limit",
                    qos.policy_span("history"),
                    hint="use 'keep_last' with a depth",
                )
