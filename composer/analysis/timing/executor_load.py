"""The load of executors, from the rates and budgets of their callbacks."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.timing.publications import Cause
from composer.analysis.timing.rates import Rates, rates
from composer.diagnostics import Label
from composer.fast_dataclass import dataclass
from composer.model import DEFAULT_EXECUTOR, Executor, ExecutorKind, Node, Port, Timer
from composer.source import Located, Span

#: Maximum number of callbacks in a message and its labels, highest load first.
SHOWN = 4


@dataclass(frozen=True, slots=True)
class CallbackLoad:
    """The load of one callback: ``rate_hz`` times ``budget_ms``."""

    name: str  # "motor.step"
    rate_hz: float
    budget_ms: Located[float]
    reentrant: bool

    @property
    def load(self) -> float:
        """Seconds per second."""
        return self.rate_hz * self.budget_ms.value / 1000.0

    def __str__(self) -> str:
        return f"{self.name} {number(self.rate_hz)} Hz x {number(self.budget_ms.value)} ms"


@dataclass(frozen=True, slots=True)
class ExecutorLoad:
    """The total load of callbacks that share ``threads`` threads."""

    what: str  # "executor 'control'"
    span: Span
    threads: int
    shares: tuple[CallbackLoad, ...]

    @property
    def ratio(self) -> float:
        """The load relative to the available threads."""
        return sum(share.load for share in self.shares) / self.threads

    @property
    def primary(self) -> Span:
        """The budget of a callback that alone needs more time than there is, or the executor."""
        heaviest = self._ordered()[0]
        return heaviest.budget_ms.span if heaviest.load > 1.0 else self.span

    @property
    def formula(self) -> str:
        """The sum, as shown in messages."""
        ordered = self._ordered()
        terms = [str(share) for share in ordered[:SHOWN]]
        if len(ordered) > SHOWN:
            terms.append(f"{len(ordered) - SHOWN} more")
        of = f" of {self.threads} threads" if self.threads > 1 else ""
        return f"{' + '.join(terms)} = {number(self.ratio * 100)} %{of}"

    @property
    def labels(self) -> tuple[Label, ...]:
        """The budgets of the callbacks with the highest load."""
        return tuple(
            Label(share.budget_ms.span, f"{share} = {number(share.load * 100)} %")
            for share in self._ordered()[:SHOWN]
        )

    def _ordered(self) -> list[CallbackLoad]:
        return sorted(self.shares, key=lambda share: (-share.load, share.name))


def executor_loads(context: Context) -> tuple[ExecutorLoad, ...]:
    """Return the load of every executor on which a callback has a budget and a known rate.

    The callbacks of a node run one at a time unless they are reentrant. So on an executor with
    several threads, each node has a load of its own as well.
    """
    known = context.once(rates)
    declared = {executor.name.value: executor for executor in context.system.executors}
    shares: dict[str, list[CallbackLoad]] = {}
    found = []
    for node in context.system.nodes:
        name = node.executor.value if node.executor is not None else DEFAULT_EXECUTOR
        of_node = tuple(_shares(known, node))
        shares.setdefault(name, []).extend(of_node)
        alone = tuple(share for share in of_node if not share.reentrant)
        if alone and name in declared and _threads(declared[name]) > 1:
            found.append(
                ExecutorLoad(f"node '{node.name}' (one at a time)", node.name.span, 1, alone)
            )
    for name, executor in declared.items():
        of_executor = tuple(shares.pop(name, ()))
        if of_executor:
            what = f"executor '{name}'"
            found.append(ExecutorLoad(what, executor.name.span, _threads(executor), of_executor))
    if shares.get(DEFAULT_EXECUTOR):
        what = f"executor '{DEFAULT_EXECUTOR}'"
        found.append(ExecutorLoad(what, context.system.span, 1, tuple(shares[DEFAULT_EXECUTOR])))
    return tuple(found)


def _threads(executor: Executor) -> int:
    return max(executor.threads, 1) if executor.kind is ExecutorKind.MULTI_THREADED else 1


def _shares(known: Rates, node: Node) -> Iterator[CallbackLoad]:
    callbacks: list[tuple[Timer | Port, Cause]] = []
    callbacks += [(timer, Cause(timer=timer)) for timer in node.timers]
    callbacks += [(port, Cause(port=port)) for port in node.ports]
    for callback, cause in callbacks:
        budget_ms = callback.budget_ms
        rate_hz = known.callback_hz(node, cause) if budget_ms is not None else None
        if budget_ms is not None and rate_hz is not None:
            yield CallbackLoad(
                f"{node.name}.{callback.name}", rate_hz, budget_ms, callback.reentrant
            )
