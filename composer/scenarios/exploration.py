"""Looks for variations with which a scenario fails: seeds, late, lost and swapped messages.

hypothesis chooses the variations, and shrinks one that fails. A variation consists of steps that
precede the steps of the scenario, so that it can be written into the file. Each run is a process.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from random import Random
from tempfile import TemporaryDirectory

import hypothesis
from hypothesis import Phase, strategies
from hypothesis.configuration import set_hypothesis_home_dir
from hypothesis.errors import NoSuchExample
from hypothesis.strategies import SearchStrategy

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.tree import Plain
from composer.model.scenario import Action, Exploration, Scenario, Step, Verb
from composer.scenarios.processes import Job, run_jobs
from composer.scenarios.runner import Options, Result

_SEEDS = 1000
_MOST_LATE = 8  # variations of one run
_LATE_STEPS = 100  # of the jitter
#: How many runs in sequence may find no smaller variation.
_MOST_FUTILE = 50


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of ``count`` messages of a topic, or calls of a timer, from the number ``first`` on.

    ``by_s`` is how late they are. Pairs of messages count as one. hypothesis prefers small values
    of what comes first.
    """

    verb: Verb
    name: str
    count: int
    first: int
    by_s: float = 0.0

    @property
    def _options(self) -> dict[str, float]:
        """The keys of the step."""
        count = 2 * self.count if self.verb is Verb.REORDER else self.count
        options = {"by_s": self.by_s, "skip": self.first - 1, "count": count}
        return {key: value for key, value in options.items() if value}

    def step(self, span: Span) -> Step:
        """Return the step that injects the fault."""
        options: dict[str, Located[Plain]]
        options = {key: Located(value, span) for key, value in self._options.items()}
        return Step(span, actions=(Action(self.verb, Located(self.name, span), options=options),))

    @property
    def yaml(self) -> str:
        """The step as text."""
        options = {key: f"{value:.7f}".rstrip("0") for key, value in self._options.items()}
        text = ", ".join(f"{key}: {value.rstrip('.')}" for key, value in options.items())
        return f"- {self.verb}: {{{self.name}: {{{text}}}}}"

    def __str__(self) -> str:
        """Return the fault in words."""
        what = (
            f"call{{}} of timer {self.name}" if "." in self.name else f"message{{}} of {self.name}"
        )
        last = self.first + int(self._options["count"]) - 1
        word = "to" if last - self.first > 1 else "and"
        plural = f"s {self.first} {word} {last}"
        text = what.format(plural if last > self.first else f" {self.first}")
        effect = f"{self.by_s * 1000.0:g} ms late"
        if self.verb is Verb.DROP:
            effect = "lost"
        elif self.verb is Verb.REORDER:
            effect = "swapped" if self.count == 1 else "swapped in pairs"
        return f"{text} {'are' if last > self.first else 'is'} {effect}"


@dataclass(frozen=True, slots=True)
class Variation:
    """What differs from the scenario in one run."""

    seed: int
    faults: tuple[Fault, ...]

    def of(self, job: Job) -> Job:
        """Return the scenario with this variation."""
        scenario = job.scenario
        steps = (fault.step(scenario.name.span) for fault in self.faults)
        varied = replace(scenario, seed=self.seed, steps=(*steps, *scenario.steps))
        return Job(varied, job.system)

    def text(self, unchanged: Variation, scenario: Scenario) -> str:
        """Return the difference from ``unchanged`` in words, and from the scenario as YAML."""
        lines = [f"seed {self.seed}"] if self.seed != unchanged.seed else []
        lines += map(str, self.faults)
        yaml = [f"seed: {self.seed}"] if self.seed != scenario.seed else []
        if self.faults:
            yaml += ["steps:", *(f"  {fault.yaml}" for fault in self.faults)]
        how = "to repeat it, add this to the scenario, before its other steps:"
        return "\n".join(["it fails with:", *_indented(lines), how, *_indented(yaml)])


def _indented(lines: Sequence[str]) -> Iterator[str]:
    return (f"    {line}" for line in lines)


def explore(
    jobs: Sequence[Job], options: Options, count: int, timeout_s: float
) -> Iterator[Result]:
    """Yield what the exploration of each scenario finds, with ``count`` variations of each."""
    return (_explored(job, options, count, timeout_s) for job in jobs)


def _explored(job: Job, options: Options, count: int, timeout_s: float) -> Result:
    """Run a scenario as it is, and with at most ``count`` variations until one fails.

    Return the result of the smallest variation that fails in the same way, or of the scenario.
    """
    started_s = time.monotonic()
    seed = job.scenario.seed if options.seed is None else options.seed
    search = _Search(job, Variation(seed, ()), replace(options, seed=None), timeout_s)
    result = search.result(search.unchanged)
    if not result.failures:
        try:
            # One more: the first variation is that nothing varies.
            smallest = _smallest(search, result.disturbable, count + 1)
            result = search.result(smallest)
            result.variation = smallest.text(search.unchanged, job.scenario)
        except NoSuchExample:
            pass
    result.explored = len(search.results) - 1
    result.took_s = time.monotonic() - started_s
    return result


class _Search:
    """Runs variations of a scenario, each once."""

    def __init__(self, job: Job, unchanged: Variation, options: Options, timeout_s: float) -> None:
        self._job = job
        self._options = options
        self._timeout_s = timeout_s
        self._failure: Span | None = None  # what failed first: smaller variations fail in this way
        self._futile = 0
        self.unchanged = unchanged
        self.bounds = job.scenario.exploration
        self.results: dict[Variation, Result] = {}

    def result(self, variation: Variation) -> Result:
        """Return the result of a run with a variation."""
        if variation not in self.results:
            job = variation.of(self._job)
            [self.results[variation]] = run_jobs([job], self._options, 1, self._timeout_s)
        return self.results[variation]

    def fails(self, variation: Variation) -> bool:
        """Return whether a variation fails as the first one that did."""
        is_new = variation not in self.results
        if is_new and self._futile == _MOST_FUTILE:
            return False
        failures = self.result(variation).failures
        if failures and self._failure is None:
            self._failure = failures[0].span
        fails = bool(failures) and failures[0].span == self._failure
        if is_new and self._failure is not None:
            self._futile = 0 if fails else self._futile + 1
        return fails


def _smallest(search: _Search, disturbable: Mapping[str, int], count: int) -> Variation:
    """Return the smallest of ``count`` variations that fails. Raises NoSuchExample.

    ``disturbable`` are the numbers of messages and calls in a run, by topic and timer.
    """
    phases = (Phase.generate, Phase.shrink)
    settings = hypothesis.settings(max_examples=count, phases=phases, database=None, deadline=None)
    seed = search.unchanged.seed
    possible = _variations(seed, search.bounds, disturbable)
    with TemporaryDirectory() as folder:
        set_hypothesis_home_dir(folder)
        try:
            return hypothesis.find(possible, search.fails, settings=settings, random=Random(seed))  # noqa: S311
        finally:
            set_hypothesis_home_dir(None)


def _variations(
    seed: int, bounds: Exploration, disturbable: Mapping[str, int]
) -> SearchStrategy[Variation]:
    chosen = {name.value for name in bounds.topics}
    counts = {name: count for name, count in sorted(disturbable.items()) if count}
    timers = {name: count for name, count in counts.items() if not name.startswith("/")}
    topics = {name: counts[name] for name in counts.keys() - timers if not chosen or name in chosen}
    lists: list[SearchStrategy[list[Fault]]] = []
    if bounds.jitter_ms is not None:
        step_s = bounds.jitter_ms.value / 1000.0 / _LATE_STEPS
        by_s = strategies.integers(1, _LATE_STEPS).map(lambda steps: round(steps * step_s, 7))
        lists.append(_faults({**topics, **timers}, None, by_s, _MOST_LATE))
    for verb, most in ((Verb.DROP, bounds.drop), (Verb.REORDER, bounds.reorder)):
        several = _faults(topics, verb, strategies.just(0.0), most)
        lists.append(several.map(partial(_limited, most)))
    return strategies.builds(
        lambda added, *faults: Variation(seed + added, tuple(chain.from_iterable(faults))),
        strategies.integers(0, _SEEDS),
        *lists,
    )


def _faults(
    counts: Mapping[str, int], verb: Verb | None, by_s: SearchStrategy[float], most: int
) -> SearchStrategy[list[Fault]]:
    """Return lists of faults of topics and timers; without a verb, they are late."""
    if not counts:
        return strategies.just([])

    def faults_of(name: str) -> SearchStrategy[Fault]:
        number = strategies.integers(1, counts[name])
        delay = Verb.DELAY if name.startswith("/") else Verb.DELAY_TIMER
        return strategies.builds(partial(Fault, verb or delay, name), number, number, by_s)

    one = strategies.sampled_from(sorted(counts)).flatmap(faults_of)
    return strategies.lists(one, max_size=most)


def _limited(most: int, faults: Sequence[Fault]) -> list[Fault]:
    """Return faults of at most ``most`` messages, or pairs of messages."""
    limited = []
    for fault in faults:
        count = min(fault.count, most)
        most -= count
        limited += [replace(fault, count=count)] if count else []
    return limited
