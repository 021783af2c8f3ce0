"""An executor on CPUs that its process may not use."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Label, warning

RULE = warning(
    code="RC481",
    name="executor-outside-process",
    summary="An executor runs on CPUs that are not among those of its process.",
    why=(
        "The CPUs of an executor take precedence, so its threads run where the process was not "
        "meant to run."
    ),
    bad="""\
system: robot
processes: {control: {nodes: [arm], cpus: [1]}}
executors: {motion: {kind: events, cpus: [2]}}
nodes:
  arm: {executor: motion, on_activate: {log: started}}
""",
    good="""\
system: robot
processes: {control: {nodes: [arm], cpus: [1, 2]}}
executors: {motion: {kind: events, cpus: [2]}}
nodes:
  arm: {executor: motion, on_activate: {log: started}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the CPUs of the executors with those of the processes of their nodes."""
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
            RULE,
            f"executor '{executor.name}' runs on {_cpus(outside)}, "
            f"but process '{process.name}' only on {_cpus(process.cpus)}",
            executor.name.span,
            (Label(process.name.span, "the process"),),
            "add them to 'cpus' of the process, or change those of the executor",
        )


def _cpus(numbers: tuple[int, ...] | list[int]) -> str:
    word = "CPU" if len(numbers) == 1 else "CPUs"
    return f"{word} {', '.join(map(str, numbers))}"
