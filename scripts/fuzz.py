"""Compare random diagrams with the reference simulator and check other laws, for a given time.

    python scripts/fuzz.py --minutes 60 --seed 7

Prints each failure as a small diagram with a script that builds it, the number of compared diagrams, and the
reasons why other diagrams cannot be compared. Equal seeds give equal diagrams. ``--laws`` selects laws of
``tests/reference/fuzz_laws.py``. The exit code is 1 after a failure.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "reference"))

from fuzz_laws import LAWS
from fuzzing import fuzz


def main() -> int:
    parser = argparse.ArgumentParser(description="Compare random diagrams with the reference simulator.")
    parser.add_argument("--minutes", type=float, default=10.0, help="duration, min")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first diagram")
    parser.add_argument("--count", type=int, default=0, help="maximum number of diagrams; 0 for no limit")
    parser.add_argument("--laws", nargs="*", default=list(LAWS), choices=list(LAWS), help="laws to check")
    parser.add_argument("--findings", type=int, default=20, help="maximum number of failures")
    parser.add_argument("--reduce", type=float, default=120.0, help="maximum time to reduce one failure, s")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    end = time.monotonic() + 60.0 * arguments.minutes
    counts: Counter[str] = Counter()

    def seeds() -> Iterator[int]:
        for seed in itertools.count(arguments.seed):
            finished = arguments.count and seed - arguments.seed >= arguments.count
            if finished or time.monotonic() > end:
                return
            yield seed

    finding_count = 0
    for finding in fuzz(seeds(), arguments.laws, counts, reduce_for=arguments.reduce):
        finding_count += 1
        print(f"--- {finding_count} ---\n{finding.report()}\n", flush=True)
        if finding_count >= arguments.findings:
            break
    totals = {name: value for name, value in counts.items() if ": " not in name}
    print(f"seeds from {arguments.seed}:", ", ".join(f"{value} {name}" for name, value in totals.items()))
    for name, value in counts.most_common():
        if ": " in name:
            print(f"{value:6} {name}")
    return 1 if finding_count else 0


if __name__ == "__main__":
    sys.exit(main())
