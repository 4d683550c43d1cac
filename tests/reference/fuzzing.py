"""The fuzzer: random diagrams, laws, and the reduction of diagrams that contradict them.

The laws are checked in a separate process, which is killed if it takes too long: a run that never returns is
a finding as well.
"""

from __future__ import annotations

import multiprocessing
import re
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from fuzz_case import InconclusiveError
from fuzz_laws import LAWS, findings
from random_diagrams import Recipe, random_recipe, reductions

from armblocks.errors import ArmblocksError
from armblocks.formats.diagram_python import diagram_to_python

Found = dict[str, list[str]]


@dataclass(frozen=True)
class Finding:
    """A law that a diagram contradicts, and the reduced diagram."""

    seed: int
    law: str
    text: str
    recipe: Recipe

    def report(self) -> str:
        """Return the finding with a script that builds the diagram."""
        try:
            script = diagram_to_python(self.recipe.diagram())
        except ArmblocksError as error:
            script = f"# not exported: {error}"
        return f"seed {self.seed}, law '{self.law}', stop_time {self.recipe.stop}\n{self.text}\n\n{script}"


def checked(recipe: Recipe, laws: Sequence[str]) -> Found:
    """Return contradictions by law. A refused diagram has none; every other exception is a finding."""
    try:
        return findings(recipe, laws)
    except InconclusiveError as reason:
        return {"inconclusive": [str(reason)]}
    except ArmblocksError as caught:
        return {"refused": [str(caught)]}
    except Exception as error:
        return {"error": [f"{error!r}\n{traceback.format_exc(limit=-4)}"]}


class CheckProcess:
    """A process that checks the laws, replaced if a diagram takes ``seconds`` of processor time."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.process: Any = None

    def __enter__(self) -> CheckProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.process = None

    def check(self, recipe: Recipe, laws: Sequence[str]) -> Found:
        if self.process is None:
            context = multiprocessing.get_context("fork")
            self.parent_end, self.child_end = context.Pipe()
            self.process = context.Process(
                target=_check_requests, args=(self.child_end, self.seconds), daemon=True
            )
            self.process.start()
        self.parent_end.send((recipe, laws))
        self.child_end.close()  # only the process holds this end: if it dies, ``recv`` raises EOFError
        try:
            return self.parent_end.recv()
        except EOFError:
            self.process.join()
            code = self.process.exitcode
            self.end()
        if code == -signal.SIGPROF:
            return {"hangs": [f"no end within {self.seconds:g} s of processor time"]}
        return {"crash": [f"the process died with exit code {code}"]}


def _check_requests(pipe: Connection, seconds: float) -> None:
    signal.signal(signal.SIGPROF, signal.SIG_DFL)  # the signal ends the process in any state
    while True:
        recipe, laws = pipe.recv()
        signal.setitimer(signal.ITIMER_PROF, seconds)
        pipe.send(checked(recipe, laws))


NO_FINDING = ("inconclusive", "refused")


def kind_of(reason: str) -> str:
    """Remove names and numbers from a reason, so that equal reasons can be counted."""
    first = reason.splitlines()[0].partition(" Allowed:")[0]
    return re.sub(r"-?\d[\d.e+-]*", "#", re.sub(r"'[^']*'", "'…'", first))[:110]


def reduced(
    check: Callable[[Recipe, Sequence[str]], Found], recipe: Recipe, law: str, until: float
) -> tuple[Recipe, str]:
    """Return the smallest diagram found that still contradicts the law, and the text of the contradiction."""
    laws = [law] if law in LAWS else list(LAWS)[:1]
    text = ""
    progress = True
    while progress and time.monotonic() < until:
        progress = False
        for smaller in reductions(recipe):
            if time.monotonic() > until:
                break
            findings = check(smaller, laws)
            if law in findings:
                recipe, text, progress = smaller, findings[law][0], True
                break
    return recipe, text


def fuzz(
    seeds: Iterator[int],
    laws: Sequence[str],
    counts: Counter[str],
    *,
    seconds: float = 300.0,
    reduce_for: float = 180.0,
) -> Iterator[Finding]:
    """Yield one finding per seed and contradicted law; ``counts`` collects the outcomes."""
    with CheckProcess(seconds) as process:
        for seed in seeds:
            recipe = random_recipe(seed)
            findings = process.check(recipe, laws)
            counts["diagrams"] += 1
            counts["blocks"] += len(recipe.nodes)
            for law, texts in findings.items():
                counts[law] += 1
                if law in NO_FINDING:
                    counts[f"{law}: {kind_of(texts[0])}"] += 1
                if law not in NO_FINDING:
                    smaller, text = reduced(process.check, recipe, law, time.monotonic() + reduce_for)
                    yield Finding(seed, law, text or texts[0], smaller)
