"""Compare armblocks with other programs and write RESULTS.md.

    python benchmarks/run.py [--quick]
        [--only dynamics,diagram,simulations,multirate,growth,stiff,startup,studio]

Needs the extras ``test`` and ``benchmark`` (Pinocchio, Drake, bdsim, PathSim; the latter two optionally in
a separate environment, see `python_peers.py`). armblocks and the other programs run in alternation. With
``--only`` the other sections of the file are unchanged. Each new section states its date and the load
average.
"""

# pyright: basic
from __future__ import annotations

import argparse
import datetime
from collections.abc import Sequence
from pathlib import Path

import paper_model
import simulations
import startup
import stiff
from measure import machine_lines, reachable_peak

import dynamics
import studio

HERE = Path(__file__).parent
KERNELS = ("fkine", "jacob0", "rne", "inertia", "gravload", "coriolis", "accel")


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]


def nanoseconds(seconds: float) -> str:
    return f"{seconds * 1e9:,.1f} ns"


def comparison_rows(rows: Sequence[dynamics.Comparison]) -> list[list[str]]:
    return [
        [
            row.name,
            row.peer,
            nanoseconds(row.theirs.median),
            nanoseconds(row.ours.median),
            f"{row.ratio:.1f} x",
            f"{row.target:g} x",
            "met" if row.ratio >= row.target else "missed",
        ]
        for row in rows
    ]


def dynamics_section(repeats: int) -> list[str]:
    lines = ["## Robot kernels", ""]
    comparisons, agreements, counts = [], [], []
    peak = reachable_peak()
    for name in ("puma560", "kr180"):
        case = dynamics.Case(name)
        agreements += [[row.name, f"{row.error:.1e}"] for row in case.agreement()]
        comparisons += case.batches(repeats) + case.singles(4 * repeats)
        counts += [[f"{name} {kernel}", *dynamics.share(case, kernel, peak, repeats)] for kernel in KERNELS]
    head = ["measurement", "other program", "its time", "armblocks", "speed-up", "target", ""]
    lines += table(head, comparison_rows(comparisons))
    lines += [
        "",
        "Time of one evaluation, median of the repetitions. The speed-up is the median over the repetitions "
        "of the ratio of the two times. The robots have no friction, because Pinocchio does not model it.",
    ]
    lines += [
        "",
        "### Agreement of the results",
        "",
        *table(["kernel", "largest difference from Pinocchio, relative"], agreements),
    ]
    lines += ["", "### Operations per evaluation, and the share of the core's arithmetic peak", ""]
    lines += table(
        ["kernel", "multiplies", "adds", "fused", "divisions, roots", "functions", "batch", "share of peak"],
        counts,
    )
    lines += [
        "",
        f"Peak: {peak / 1e9:.1f} G multiplies and adds per second, reached by one core in a 1024 x 1024 "
        "matrix product. A fused operation counts as one multiply and one add; divisions, roots and the "
        "arithmetic inside sin and cos are not counted, so the share is a lower bound.",
    ]
    return lines


def diagram_section(repeats: int) -> list[str]:
    theirs, ours = paper_model.compare(repeats)
    ratio = ours.times_faster_than(theirs)
    row = [
        "kr180model, 10 s at 10 ms, run without compilation",
        "Drake, native systems",
        f"{theirs.median * 1e3:.2f} ms",
        f"{ours.median * 1e3:.4f} ms",
        f"{ratio:.0f} x",
        "500 x",
        "met" if ratio >= 500 else "missed",
    ]
    head = ["measurement", "other program", "its time", "armblocks", "speed-up", "target", ""]
    return [
        "## Block diagrams",
        "",
        *table(head, [row]),
        "",
        *(paper_model.__doc__ or "").strip().splitlines()[2:],
    ]


def compared_table(group: str, repeats: int) -> list[str]:
    compared = [
        [
            row.name,
            row.peer,
            f"{row.theirs.median * 1e3:,.1f} ms",
            f"{row.ours.median * 1e3:.3f} ms",
            f"{row.ratio:,.0f} x",
            f"{row.target:g} x" if row.target else "",
            "" if not row.target else "met" if row.ratio >= row.target else "missed",
            f"{row.difference:.0e}",
        ]
        for row in simulations.rows(group, repeats)
    ]
    head = [
        "measurement",
        "other program",
        "its time",
        "armblocks",
        "speed-up",
        "target",
        "",
        "final values differ by",
    ]
    return table(head, compared)


def simulations_section(repeats: int) -> list[str]:
    message = (simulations.__doc__ or "").split("Multirate: ")[0].strip().splitlines()[2:]
    return ["## Whole simulations", "", *compared_table("simulations", repeats), "", *message]


def multirate_section(repeats: int) -> list[str]:
    message = "Multirate: " + (simulations.__doc__ or "").split("Multirate: ")[1].strip()
    compared = compared_table("multirate", max(1, repeats // 3))
    return ["## A multirate simulation", "", *compared, "", *message.splitlines()]


def growth_section(repeats: int) -> list[str]:
    grown = simulations.growth(max(1, repeats // 3))
    head = ["chain", "build", "trace", "compile", "run 10 s", "total, s", "median of repetitions, s"]
    return [
        "## Diagrams of many blocks",
        "",
        *table(head, grown),
        "",
        "Seconds, minimum of the repetitions, each in a new process without a cache. `mixed`: gains, "
        "first-order transfer functions, unit delays at 10 ms and saturations in alternation.",
    ]


def startup_section(repeats: int) -> list[str]:
    numpy, armblocks = startup.imports(3 * repeats)
    cold, warm = startup.first_result(repeats)
    report = startup.complete_report(repeats)
    extra = armblocks.median - numpy.median
    rows = [
        ["`import armblocks`, beyond `import numpy`", f"{extra:.3f} s", "0.10 s", extra <= 0.10],
        ["process start → first rne, empty cache", f"{cold.median:.3f} s", "0.8 s", cold.median <= 0.8],
        ["process start → first rne, cached", f"{warm.median:.3f} s", "0.25 s", warm.median <= 0.25],
        [
            "`armblocks run kr180model`, cached, all figures",
            f"{report.median:.2f} s",
            "3 s",
            report.median <= 3,
        ],
    ]
    lines = [
        "## Start-up",
        "",
        *table(
            ["measurement", "armblocks", "target", ""],
            [[a, b, c, "met" if d else "missed"] for a, b, c, d in rows],
        ),
    ]
    return [*lines, "", f"`import numpy` alone: {numpy.median:.3f} s. Complete processes, medians."]


SECTIONS = {
    "dynamics": dynamics_section,
    "diagram": diagram_section,
    "simulations": simulations_section,
    "multirate": multirate_section,
    "growth": growth_section,
    "stiff": stiff.stiff_section,
    "startup": startup_section,
    "studio": studio.studio_section,
}


def with_section(text: str, section: Sequence[str]) -> str:
    """Return ``text`` with ``section`` in place of the section with the same heading, or at the end."""
    parts = text.split("\n## ")
    heading = section[0].removeprefix("## ")
    body = "\n".join([heading, *section[1:]]).rstrip() + "\n"
    places = [k for k, part in enumerate(parts) if part.split("\n")[0] == heading]
    if places:
        parts[places[0]] = body
    else:
        parts.append(body)
    return "\n## ".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--quick", action="store_true", help="fewer repetitions; the result is printed and not written"
    )
    parser.add_argument("--only", default=",".join(SECTIONS), help="sections, separated by commas")
    arguments = parser.parse_args()
    repeats = 3 if arguments.quick else 15
    names = arguments.only.split(",")
    machine = machine_lines(["armblocks", "numpy", "casadi", "llvmlite", "pin", "drake"])
    today = datetime.date.today().isoformat()
    sections = {name: SECTIONS[name](repeats) for name in names}
    for section in sections.values():
        print("\n".join(section), "\n")
    if arguments.quick:
        return
    results = HERE / "RESULTS.md"
    notes = (HERE / "NOTES.md").read_text().rstrip() + "\n"
    if set(names) == set(SECTIONS) or not results.exists():
        lines = ["# Benchmark results", "", f"{today}, by `python benchmarks/run.py`.", ""]
        lines += [f"- {line}" for line in machine]
        for section in sections.values():
            lines += ["", *section]
        text = "\n".join(lines) + "\n\n" + notes
    else:
        text = results.read_text().split("\n" + notes.splitlines()[0])[0].rstrip() + "\n"
        for section in sections.values():
            message = ["", f"Measured separately on {today}: {machine[-1]}."]
            text = with_section(text, [*section, *message])
        text += "\n" + notes
    results.write_text(text)


if __name__ == "__main__":
    main()
