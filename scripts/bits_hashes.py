"""Print one hash for each group of results that the documents guarantee to be equal on every machine.

``python scripts/bits_hashes.py [--cpu NAME --lanes N]``, with armblocks importable; ``scripts/bits.py`` runs
it for several processors and compares the hashes. ``--cpu`` is an LLVM name of the processor to compile for.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from armblocks.compiler import target as targets

Numbers = Iterator[tuple[str, np.ndarray]]
ROWS = 37
"""Number of samples in a batch. It is not a multiple of any number of lanes."""
BINARY_FUNCTIONS = ("atan2", "hypot", "fmod", "remainder", "power")


def compile_for(cpu: str, lanes: int) -> None:
    """Compile all code of this process for another processor. Call this before other imports of armblocks."""
    target = replace(targets.host_target(), cpu=cpu, features="", lanes=lanes)
    targets.host_target = lambda: target  # pyright: ignore[reportAttributeAccessIssue]


def random_numbers(rng: np.random.Generator, count: int, exponents: int) -> np.ndarray:
    """Random numbers of both signs with binary exponents up to ``exponents``, without the C library."""
    return np.ldexp(2.0 * rng.random(count) - 1.0, rng.integers(-exponents, exponents, count, endpoint=True))


def elementary_functions() -> Numbers:
    """Results of every elementary function, for arguments of all magnitudes, single and in batches."""
    import casadi

    from armblocks.compiler import compile_function
    from armblocks.equations import TracedFunction, signature

    names = [
        *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
        *("exp", "expm1", "log", "log1p", "erf", "sqrt", *BINARY_FUNCTIONS),
    ]
    rng = np.random.default_rng(9)
    special = [0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 5e-324, 2.3e-308, 1e308, 710.0, -745.0, 1e22]
    large = random_numbers(rng, 400, 1000)
    pool = np.concatenate([special, random_numbers(rng, 2000, 1), 20.0 * random_numbers(rng, 1000, 1), large])
    first, second = (rng.choice(pool, 4001).reshape(-1, 1) for _ in range(2))
    for name in names:
        operation = (lambda a, b: a**b) if name == "power" else getattr(casadi, name)
        unary = name not in BINARY_FUNCTIONS
        traced = TracedFunction.trace(
            name,
            signature(("a", (1,)), ("b", (1,))),
            signature(("y", (1,))),
            (lambda a, b, f=operation: f(a)) if unary else operation,
        )
        kernel = compile_function(traced)
        yield name, kernel(first, second)
        yield f"{name} single", np.array([kernel(a, b) for a, b in zip(first[:400], second[:400])])


def rounded_constants() -> Numbers:
    """Results of the functions that compute constants."""
    from armblocks.rounded_functions import FUNCTIONS

    rng = np.random.default_rng(10)
    for name, function in FUNCTIONS.items():
        values = np.concatenate(
            [random_numbers(rng, 200, 1), random_numbers(rng, 100, 40), random_numbers(rng, 20, 1000)]
        )
        arguments = (
            zip(values, rng.permutation(values)) if name in ("atan2", "hypot", "power") else zip(values)
        )
        yield name, np.array([function(*map(float, numbers_in)) for numbers_in in arguments])


def linear_algebra() -> Numbers:
    """Solutions of linear equations and matrix-vector products, single and in batches."""
    from casadi import mtimes

    from armblocks.compiler import compile_function
    from armblocks.equations import TracedFunction, signature
    from armblocks.equations.linear_solution import linear_solution

    rng = np.random.default_rng(12)
    functions = {"solution": (linear_solution, (2, 3, 7, 20)), "product": (mtimes, (3, 16, 33))}
    for name, (function, sizes) in functions.items():
        for n in sizes:
            traced = TracedFunction.trace(
                name,
                signature(("A", (n, n)), ("b", (n,))),
                signature(("x", (n,))),
                lambda A, b, function=function: [function(A, b)],
            )
            kernel = compile_function(traced)
            A, b = rng.random((ROWS, n, n)) - 0.5, rng.random((ROWS, n)) - 0.5
            yield f"{name} {n}", kernel(A, b)
            yield f"{name} {n} of one matrix", kernel(A[0], b)
            yield f"{name} {n} single", np.array([kernel(*pair) for pair in zip(A, b)])


def robots() -> Numbers:
    """Results of every dynamics function of some shipped robots and of a robot with oblique axes."""
    import armblocks as ab
    from armblocks import dynamics
    from armblocks.compiler import compile_function
    from armblocks.errors import RobotError

    base = ab.modified_dh("base", alpha=0.4, theta=0.9).before
    oblique = ab.Robot(
        name="skew",
        base=base,
        links=tuple(
            ab.modified_dh(
                f"l{k}",
                parent=f"l{k - 1}" if k else None,
                alpha=0.3 + k,
                a=0.1 * k,
                d=0.2,
                sigma=k % 2,
                offset=0.7 * k,
                mass=1.0 + k,
                centre_of_mass=(0.1, 0.2, 0.3 * k),
            )
            for k in range(3)
        ),
    )
    names = ("kr180", "kr180_cell", "panda", "planar3r", "puma560", "stanford", "twolink")
    shipped = [ab.load_robot(name).robot for name in names]
    rng = np.random.default_rng(11)
    for robot in (*shipped, oblique):
        for name in sorted(name for name in dir(dynamics) if name.startswith("trace_")):
            try:
                traced = getattr(dynamics, name)(robot)
            except (TypeError, RobotError):
                continue  # this function has other arguments than a robot, or needs prescribed motions
            if not hasattr(traced, "casadi_function"):
                continue
            kernel = compile_function(traced)
            numbers_in = [4.0 * rng.random((ROWS, *slot.shape)) - 2.0 for slot in traced.inputs]
            results = kernel(*numbers_in)
            for part in results if isinstance(results, tuple) else (results,):
                yield f"{robot.name} {name}", part
            single = kernel(*(array[0] for array in numbers_in))
            for part in single if isinstance(single, tuple) else (single,):
                yield f"{robot.name} {name} single", part


FORMULAS = (
    *("u*cos(1.995)", "u*exp(0.529)", "u*expm1(1.769)", "u*erf(0.31)", "u*acosh(1.7)", "u*sinh(0.7)^u"),
    *("u*2.2^u", "u*3^0.41", "u*atan2(0.3, 1.1)", "u*log10(7)", "sin([0.3; u; 1.4])", "u*hypot(0.3, 0.41)"),
    *("atan2(-(u*3-6), -1)", "u*norm([0.1 0.2 0.7])", "u*tan(1.3)/atanh(0.35)"),
)


def constants() -> Numbers:
    """Signals of diagrams with constants in formulas and filters."""
    import armblocks as ab
    from armblocks.blocks import AnalogFilter, Clock, DigitalFilter, Expression, Integrator

    def run(name: str, solver: str, add_design: Callable[[ab.DiagramBuilder], object]) -> Numbers:
        builder = ab.DiagramBuilder("d")
        builder.log(add_design(builder))  # pyright: ignore[reportArgumentType]
        result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.1, solver=solver)
        for path in result.names:
            yield f"{name} {solver} {path}", np.asarray(result[path])

    for text in FORMULAS:
        yield from run(
            text, "rk4", lambda d, text=text: d.add("e", Expression(formula=text), d.add("c", Clock()))
        )
    for text in ("2.2^u - u", "cos(1.2)*u - 3^u"):

        def feedback(d: ab.DiagramBuilder, text: str = text) -> object:
            state = d.add("x", Integrator(initial=0.3))
            d.connect(d.add("e", Expression(formula=text), state), state)
            return state

        for solver in ("rodas5p", "ros23", "dopri5"):
            yield from run(text, solver, feedback)
    for design in ("butterworth", "chebyshev1", "chebyshev2"):
        for kind in ("low_pass", "high_pass", "band_pass", "band_stop"):
            for block in (AnalogFilter, DigitalFilter):
                parameters = {
                    "edge": 0.31,
                    "upper_edge": 0.47,
                    "order": 5,
                    "design": design,
                    "filter_type": kind,
                }
                options = {"sample_time": 0.01} if block is DigitalFilter else {}
                yield from run(
                    f"{block.__name__} {design} {kind}",
                    "rk4",
                    lambda d, block=block, parameters=parameters | options: d.add(
                        "f", block(**parameters), d.add("c", Clock())
                    ),
                )


def shipped_blocks() -> Numbers:
    """Signals of the worked example of every block."""
    import armblocks as ab

    for kind in ab.list_blocks():
        result = ab.simulate(ab.block_example(kind))
        for path in result.names:
            yield f"{kind} {path}", np.asarray(result[path])


def shipped_diagrams() -> Numbers:
    """Signals of every shipped diagram, for the first 0.2 s."""
    import armblocks as ab

    for name in ab.list_examples():
        result = ab.simulate(ab.load_diagram(name), stop_time=0.2)
        for path in result.names:
            yield f"{name} {path}", np.asarray(result[path])


GROUPS: dict[str, Callable[[], Numbers]] = {
    "elementary functions": elementary_functions,
    "rounded constants": rounded_constants,
    "linear algebra": linear_algebra,
    "robots": robots,
    "constants": constants,
    "blocks": shipped_blocks,
    "diagrams": shipped_diagrams,
}


def canonical(numbers: np.ndarray) -> bytes:
    """Bytes of an array. All NaNs have the same bytes, because their sign and payload are not guaranteed."""
    array = np.array(numbers, dtype=np.float64)
    array[np.isnan(array)] = np.nan
    return array.tobytes()


def main() -> None:
    """Print one line for each group, and with ``--details`` one for each array."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cpu")
    parser.add_argument("--lanes", type=int, default=2)
    parser.add_argument("--details", action="store_true", help="also print a line for each array")
    parser.add_argument("groups", nargs="*", help=f"groups of results: {', '.join(GROUPS)} (default: all)")
    requested = parser.parse_args()
    if requested.cpu:
        compile_for(requested.cpu, requested.lanes)
    warnings.simplefilter("ignore")
    for group in requested.groups or GROUPS:
        group_hash = hashlib.sha256()
        count = 0
        for name, numbers in GROUPS[group]():
            data = canonical(numbers)
            group_hash.update(name.encode() + data)
            count += 1
            if requested.details:
                print(f"  {group} | {name} {hashlib.sha256(data).hexdigest()[:12]}")
        print(f"{group}: {group_hash.hexdigest()[:24]} ({count} arrays)")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
