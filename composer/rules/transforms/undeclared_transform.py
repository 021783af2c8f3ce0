"""A behavior that uses transforms that its node does not declare."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import earlier_errors
from composer.analysis.frame_uses import BROADCAST, FrameUse
from composer.analysis.frames import place, uses_of_behaviors
from composer.diagnostics import Diagnostic, Label, error, suggestion
from composer.model import DynamicTransform, Node, StaticTransform
from composer.source import Located

RULE = error(
    code="RC517",
    name="undeclared-transform",
    summary="A behavior looks up or broadcasts transforms that its node does not declare.",
    why=(
        "The node listens to /tf only if it declares 'lookup', and broadcasts only the frames "
        "that it declares. Otherwise these could not be checked."
    ),
    bad="""\
# file: system.yaml
system: rover
nodes:
  mount:
    behavior: mount:Mount
    transforms: {dynamic: {gripper: {parent: wrist}}}
    timers: {tick: {period_ms: 100}}
# file: mount.py
from geometry_msgs.msg import Transform


class Mount:
    def on_tick(self):
        self.transforms.broadcast("griper", Transform())
""",
    good="""\
# file: system.yaml
system: rover
nodes:
  mount:
    behavior: mount:Mount
    transforms: {dynamic: {gripper: {parent: wrist}}}
    timers: {tick: {period_ms: 100}}
# file: mount.py
from geometry_msgs.msg import Transform


class Mount:
    def on_tick(self):
        self.transforms.broadcast("gripper", Transform())
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the calls of ``self.transforms`` with what the node declares."""
    errors = context.once(earlier_errors)
    for node, use in context.once(uses_of_behaviors):
        if not node.complete or errors.may_declare(node.name.value, "transforms"):
            continue
        if use.method != BROADCAST:
            yield from _lookup(node, use)
            continue
        for frame in use.frames:
            yield from _broadcast(node, frame)


def _lookup(node: Node, use: FrameUse) -> Iterator[Diagnostic]:
    if node.transforms is not None and node.transforms.lookup is not None:
        return
    message = f"'{use.method}' needs 'transforms' with 'lookup', which node '{node.name}' lacks"
    names = ", ".join(dict.fromkeys(frame.value for frame in use.frames))
    span, labels = place(node, Located(use.method, use.span))
    yield Diagnostic(RULE, message, span, labels, f"add 'transforms: {{lookup: [{names}]}}'")


def _broadcast(node: Node, frame: Located[str]) -> Iterator[Diagnostic]:
    declared = node.transforms.broadcasts if node.transforms is not None else ()
    known = {item.child.value: item for item in declared}
    span, labels = place(node, frame)
    found = known.get(frame.value)
    if found is None:
        message = f"node '{node.name}' does not declare the frame '{frame}'"
        hint = suggestion(frame.value, known) or "declare it under 'transforms: {dynamic: ...}'"
        yield Diagnostic(RULE, message, span, labels, hint)
    elif not _is_from_code(found):
        message = f"the declaration broadcasts the frame '{frame}' already"
        label = Label(found.child.span, "declared here")
        change = "remove 'from'"
        if isinstance(found, StaticTransform):
            values = " instead of the values" if found.values is not None else ""
            change = f"write 'from_code: true'{values}"
        hint = f"{change} there, or do not broadcast it here"
        yield Diagnostic(RULE, message, span, (*labels, label), hint)


def _is_from_code(declared: StaticTransform | DynamicTransform) -> bool:
    if isinstance(declared, DynamicTransform):
        return declared.source is None
    return declared.from_code
