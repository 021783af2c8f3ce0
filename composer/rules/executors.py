"""Executors: their nodes, threads, CPUs and load."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from composer.base.diagnostics import (
    Diagnostic,
    Label,
    Severity,
    Subject,
    error,
    errors_subject,
    info,
    warning,
)
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.rules import UNUSED_DECLARATION
from composer.model import DEFAULT_EXECUTOR, Executor, ExecutorKind, Node, Port, Timer
from composer.rules.analysis.context import Context
from composer.rules.analysis.formatting import number
from composer.rules.analysis.rates import Cause, rates
from composer.rules.analysis.subjects import earlier_errors, used_parameters
from composer.rules.references import unknown_names

EXECUTOR_OVERLOADED = error("RC413", "executor-overloaded")
EXECUTOR_SETTINGS = warning("RC417", "executor-settings")
LOST_BETWEEN_PROCESSES = info("RC480", "lost-between-processes")

_EXECUTOR_BUSY = replace(EXECUTOR_OVERLOADED, severity=Severity.WARNING)
#: From this load on, an executor is busy.
_BUSY = 0.7
#: Maximum number of callbacks in a message and its labels, highest load first.
SHOWN = 4


def check_unknown_executor(context: Context) -> Iterator[Diagnostic]:
    """Check the executor of every node that names one."""
    nodes = context.system.nodes
    named = ((f"node '{node.name}' runs on '{node.executor}'", node.executor) for node in nodes)
    yield from unknown_names(context, "executor", named)


def check_unused_executor(context: Context) -> Iterator[Diagnostic]:
    """Compare the executors with the nodes. An executor named ``default`` runs all other nodes."""
    used = {
        node.executor.value if node.executor else DEFAULT_EXECUTOR for node in context.system.nodes
    }
    known = {executor.name.value for executor in context.system.executors} | {DEFAULT_EXECUTOR}
    if not used <= known or context.once(earlier_errors).any:
        return  # an unknown name may be a misspelling of the unused one
    for executor in context.system.executors:
        if executor.name.value not in used:
            yield Diagnostic(
                UNUSED_DECLARATION,
                f"no node runs on '{executor.name}'",
                executor.name.span,
                relies_on=(errors_subject(executor.name.span),),
            )


def check_single_thread(context: Context) -> Iterator[Diagnostic]:
    """Check the numbers of threads."""
    for executor in context.system.executors:
        if executor.kind is ExecutorKind.MULTI_THREADED and executor.threads == 1:
            yield Diagnostic(
                EXECUTOR_SETTINGS,
                f"executor '{executor.name}' is multi_threaded, but has one thread",
                executor.threads_span or executor.name.span,
                hint="use two or more threads, or 'kind: events'",
            )
        elif executor.kind is not ExecutorKind.MULTI_THREADED and _declares_several_threads(
            executor
        ):
            yield Diagnostic(
                EXECUTOR_SETTINGS,
                f"executor '{executor.name}' has one thread, as its kind is {executor.kind}",
                executor.threads_span or executor.name.span,
                hint="add 'kind: multi_threaded', or remove 'threads'",
            )


def _declares_several_threads(executor: Executor) -> bool:
    """Return whether several threads are written; the default does not count."""
    return executor.threads_span is not None and executor.threads > 1


def check_split_executor(context: Context) -> Iterator[Diagnostic]:
    """Compare the processes of the nodes on each executor, except for the default one."""
    first: dict[str, Node] = {}
    reported: set[str] = set()
    for node in context.system.nodes:
        if node.executor is None or node.executor.value == DEFAULT_EXECUTOR:
            continue
        name = node.executor.value
        other = first.setdefault(name, node)
        if other.process == node.process or name in reported:
            continue
        reported.add(name)
        at = node.executor.span if other.executor is None else other.executor.span
        yield Diagnostic(
            LOST_BETWEEN_PROCESSES,
            f"'{name}' is one executor in {_process_text(node)} "
            f"and another one in {_process_text(other)}",
            node.executor.span,
            (Label(at, f"in {_process_text(other)}"),),
            relies_on=tuple(
                (kind, item.process.value)
                for item in (node, other)
                if item.process is not None
                for kind in ("process", "nodes of process")
            ),
        )


def _process_text(node: Node) -> str:
    return "the process of the system" if node.process is None else f"process '{node.process}'"


def check_executor_outside_process(context: Context) -> Iterator[Diagnostic]:
    """Compare the CPUs of executors with the CPUs of the processes of their nodes."""
    system = context.system
    processes = {process.name.value: process for process in system.processes}
    executors = {executor.name.value: executor for executor in system.executors}
    reported: set[tuple[str, str]] = set()
    for node in system.nodes:
        if node.process is None or node.executor is None:
            continue
        process = processes.get(node.process.value)
        executor = executors.get(node.executor.value)
        if process is None or executor is None or not process.cpus:
            continue
        outside = sorted(set(executor.cpus) - set(process.cpus))
        pair = (process.name.value, executor.name.value)
        if not outside or pair in reported:
            continue
        reported.add(pair)
        yield Diagnostic(
            EXECUTOR_SETTINGS,
            f"executor '{executor.name}' runs on {_cpu_text(outside)}, "
            f"but process '{process.name}' only on {_cpu_text(process.cpus)}",
            executor.name.span,
            (Label(process.name.span, "the process"),),
            "add them to 'cpus' of the process, or change 'cpus' of the executor",
        )


def _cpu_text(numbers: tuple[int, ...] | list[int]) -> str:
    word = "CPU" if len(numbers) == 1 else "CPUs"
    return f"{word} {', '.join(map(str, numbers))}"


@dataclass(frozen=True, slots=True)
class CallbackLoad:
    """The load of one callback: ``rate_hz`` times ``budget_ms``."""

    name: str  # "motor.step"
    rate_hz: float
    budget_ms: Located[float]
    reentrant: bool
    parameters: tuple[Subject, ...]

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

    @property
    def parameters(self) -> tuple[Subject, ...]:
        """The parameters that the rates depend on."""
        return tuple(item for share in self.shares for item in share.parameters)

    def _ordered(self) -> list[CallbackLoad]:
        return sorted(self.shares, key=lambda share: (-share.load, share.name))


def executor_loads(context: Context) -> tuple[ExecutorLoad, ...]:
    """Return the load of every executor on which a callback has a budget and a known rate.

    The callbacks of a node run one at a time unless they are reentrant. So on an executor with
    several threads, each node has a load of its own as well.
    """
    declared = {executor.name.value: executor for executor in context.system.executors}
    shares: dict[str, list[CallbackLoad]] = {}
    found = []
    for node in context.system.nodes:
        name = node.executor.value if node.executor is not None else DEFAULT_EXECUTOR
        of_node = tuple(_shares(context, node))
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


def _shares(context: Context, node: Node) -> Iterator[CallbackLoad]:
    callbacks: tuple[Timer | Port, ...] = (*node.timers, *node.ports)
    for callback in callbacks:
        budget_ms = callback.budget_ms
        if budget_ms is None:
            continue
        timer, port = (callback, None) if isinstance(callback, Timer) else (None, callback)
        rate_hz = context.once(rates).callback_hz(node, Cause(timer, port))
        if rate_hz is not None:
            period = timer.period.value if timer is not None else None
            name = f"{node.name}.{callback.name}"
            used = used_parameters(period)
            yield CallbackLoad(name, rate_hz, budget_ms, callback.reentrant, used)


def check_executor_load(context: Context) -> Iterator[Diagnostic]:
    """Add up the budgets of every executor."""
    for load in context.once(executor_loads):
        if load.ratio > 1.0:
            yield Diagnostic(
                EXECUTOR_OVERLOADED,
                f"callbacks of {load.what} may need more time than it has: {load.formula}",
                load.primary,
                load.labels,
                "lower a rate or a budget, or move nodes to another executor",
                relies_on=load.parameters,
            )
        elif load.ratio > _BUSY:
            yield Diagnostic(
                _EXECUTOR_BUSY,
                f"callbacks of {load.what} may use most of its time: {load.formula}",
                load.span,
                load.labels,
                relies_on=load.parameters,
            )
