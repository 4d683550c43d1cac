"""The linear equations of a Rosenbrock step, as LLVM IR: ``(E / gamma - h J) k = right``.

``E`` is one for the rows of the flow and zero for those of implicit equations. A large sparse matrix is
eliminated in the order that :mod:`armblocks.compiler.elimination` planned, with its pivots on the diagonal
and work in proportion to its entries. Its first solution is judged by what it leaves over, each row beside
the sizes of its own terms (Oettli, Prager, *Numer. Math.* 6 (1964) 405-409: no scaling of states or equations
changes that). Where this is too much, and for small or full matrices always, the whole matrix is eliminated
with row pivoting instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from armblocks.compiler.elimination import Elimination, JacobianPattern, plan_elimination
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import Module, number_text

SMALL = 8
"""Up to this size the whole matrix is eliminated with pivoting: nothing else is faster."""
FULL = 0.5
"""So it is where L and U have this part of all its entries."""
SCALING_ROUNDS = 6
"""Rounds in which the bound of the rates comes down to within a factor of about two, for most matrices."""
LEFT_OVER = 1e-7
"""A relative remainder that makes the elimination without pivoting count as failed. A Rosenbrock method with
a Jacobian this wrong is still far more accurate than the tolerances that it is chosen for."""


class LinearSpace:
    """Where the numbers of the linear equations lie in ``%scratch``, memory that no step leaves to the next.

    ``J`` and ``T`` are what the system's ``flow_jacobian`` writes; ``right`` and ``solution`` are numbered as
    the equations and unknowns are. ``swaps`` and ``whole``, whether the whole matrix was eliminated, are
    integers.
    """

    def __init__(self, pattern: JacobianPattern) -> None:
        self.pattern = pattern
        self.n, self.size = pattern.states, pattern.size
        plan: Elimination | None = plan_elimination(pattern) if pattern.size > SMALL else None
        if plan is not None and plan.filled > FULL * pattern.size**2:
            plan = None
        self.plan = plan
        inside = 0 if plan is None else plan.filled
        self.J = 0
        self.T = self.J + len(pattern.rows)
        self.right = self.T + self.size
        self.solution = self.right + self.size
        self.work = self.solution + self.size
        self.pivots = self.work + self.size
        self.lower = self.pivots + self.size
        self.swaps = self.lower + inside
        self.whole = self.swaps + self.size
        self.matrix = self.whole + 1
        self.length = self.matrix + self.size**2


def emit_linear_equations(module: Module, space: LinearSpace, gamma: float) -> None:
    """Add ``void factor(ptr scratch, double h)``, ``void factor_whole(ptr scratch, double h)``, ``void
    solve_linear(ptr scratch)`` and, for sparse ones, ``i1 solved_well(ptr scratch, double h)``."""
    writer = _Writer(module, space, 1.0 / gamma)
    module.define("factor_whole", writer.factor_whole)
    if space.plan is not None:
        sparse = _Sparse(module, space, space.plan, 1.0 / gamma)
        module.define("factor", sparse.factor)
        module.define("solved_well", sparse.solved_well)
        module.define("solve_sparse", sparse.solve)
    module.define("solve_linear", writer.solve)


def emit_rate_bound(module: Module, space: LinearSpace) -> None:
    """Add ``double rate_bound(ptr scratch)``: no less than the magnitude of any eigenvalue of ``J``.

    For any positive v, that is ``max_i (|J| v)_i / v_i`` (Collatz, Wielandt; Horn, Johnson, Matrix Analysis,
    8.1.31 and 8.1.18). A few rounds of ``v = sqrt(v |J| v)`` make v fit the scales of the states.
    """

    def write() -> str:
        w, n = Routine(module), str(space.n)
        rows = constant_integers(module, "jacobian.rows", space.pattern.rows)
        columns = constant_integers(module, "jacobian.columns", space.pattern.columns)
        bound, zero = w.variable("double", number_text(0.0)), number_text(0.0)

        def at(place: int, index: str) -> str:
            return w.at("%scratch", w.word_op("add", index, str(place)))

        def entry(k: str) -> None:
            row, column = (w.get(w.at(table, k, "i64"), "i64") for table in (rows, columns))
            weight = w.multiply(w.absolute(w.get(at(space.J, k))), w.get(at(space.right, column)))
            w.put(w.add(w.get(at(space.work, row)), weight), at(space.work, row))

        def compare(i: str) -> None:
            v, u = w.get(at(space.right, i)), w.get(at(space.work, i))
            w.put(w.maximum(w.get(bound), w.divide(u, v)), bound)
            middle = w.square_root(w.multiply(v, u))
            w.put(w.select(w.compare("ogt", middle, zero), middle, v), at(space.right, i))

        def turn(_: str) -> None:
            w.put(zero, bound)
            w.count("0", n, lambda i: w.put(zero, at(space.work, i)))
            w.count("0", str(len(space.pattern.rows)), entry)
            w.count("0", n, compare)

        w.count("0", n, lambda i: w.put(number_text(1.0), at(space.right, i)))
        w.count("0", str(SCALING_ROUNDS), turn)
        w.do(f"ret double {w.get(bound)}")
        return w.text("define internal double @rate_bound(ptr %scratch) noinline")

    module.define("rate_bound", write)


def constant_integers(module: Module, symbol: str, values: Sequence[int]) -> str:
    """A constant array of the module; gives its address."""
    numbers = ", ".join(f"i64 {value}" for value in values) or "i64 0"
    module.add(symbol, f"@{symbol} = internal constant [{max(1, len(values))} x i64] [{numbers}]")
    return f"@{symbol}"


class _Writer:
    """Elimination of the whole matrix, with row pivoting."""

    def __init__(self, module: Module, space: LinearSpace, diagonal: float) -> None:
        self.module = module
        self.space = space
        self.n, self.size = space.n, space.size
        self.diagonal = diagonal

    def at(self, w: Routine, place: int, index: str) -> str:
        return w.at("%scratch", w.word_op("add", index, str(place)))

    def entry(self, w: Routine, row: str, column: str) -> str:
        place = w.word_op("add", w.word_op("mul", row, str(self.size)), column)
        return self.at(w, self.space.matrix, place)

    def factor_whole(self) -> str:
        w, size = Routine(self.module), str(self.size)
        pattern, space = self.space.pattern, self.space
        entries = range(len(pattern.rows))
        targets = constant_integers(
            self.module,
            "jacobian.places",
            [pattern.rows[k] * self.size + pattern.columns[k] for k in entries],
        )
        w.put("1", w.at("%scratch", space.whole, "i64"), "i64")
        zero = number_text(0.0)
        w.count("0", str(self.size**2), lambda i: w.put(zero, self.at(w, space.matrix, i)))
        diagonal = number_text(self.diagonal)
        w.count("0", str(self.n), lambda i: w.put(diagonal, self.entry(w, i, i)))
        minus_h = w.negate("%h")

        def place(k: str) -> None:
            target = self.at(w, space.matrix, w.get(w.at(targets, k, "i64"), "i64"))
            w.put(w.fma(minus_h, w.get(self.at(w, space.J, k)), w.get(target)), target)

        w.count("0", str(len(pattern.rows)), place)
        w.count("0", size, lambda k: self.eliminate(w, k))
        w.do("ret void")
        return w.text("define internal void @factor_whole(ptr %scratch, double %h) noinline")

    def eliminate(self, w: Routine, k: str) -> None:
        """Column ``k``: the largest entry to the diagonal, factors below it in place of the zeros."""
        size, space = str(self.size), self.space
        below = w.word_op("add", k, "1")
        best = w.variable("i64", k)

        def look(i: str) -> None:
            known = w.get(best, "i64")
            a, b = (w.absolute(w.get(self.entry(w, row, k))) for row in (i, known))
            w.put(w.let(f"select i1 {w.compare('ogt', a, b)}, i64 {i}, i64 {known}"), best, "i64")

        w.count(below, size, look)
        row = w.get(best, "i64")
        w.put(row, w.at("%scratch", w.word_op("add", k, str(space.swaps)), "i64"), "i64")

        def swap(j: str) -> None:
            one, other = self.entry(w, k, j), self.entry(w, row, j)
            a, b = w.get(one), w.get(other)
            w.put(b, one)
            w.put(a, other)

        w.count("0", size, swap)
        inverse = w.divide(number_text(1.0), w.get(self.entry(w, k, k)))
        w.put(inverse, self.at(w, space.pivots, k))

        def rows(i: str) -> None:
            place = self.entry(w, i, k)
            factor = w.multiply(w.get(place), inverse)
            w.put(factor, place)
            minus = w.negate(factor)
            apply, on = w.fresh("apply"), w.fresh("on")
            w.branch(w.compare("une", factor, number_text(0.0)), apply, on)
            w.place(apply)

            def subtract(j: str) -> None:
                target = self.entry(w, i, j)
                w.put(w.fma(minus, w.get(self.entry(w, k, j)), w.get(target)), target)

            w.count(below, size, subtract)
            w.place(on)

        w.count(below, size, rows)

    def solve(self) -> str:
        """Rows of the factors swap along with those of the matrix, so the right side does first."""
        w, space, size = Routine(self.module), self.space, str(self.size)
        if space.plan is not None:
            whole, sparse = w.fresh("whole"), w.fresh("sparse")
            flag = w.get(w.at("%scratch", space.whole, "i64"), "i64")
            w.branch(w.word_test("ne", flag, "0"), whole, sparse)
            w.place(sparse)
            w.do("call void @solve_sparse(ptr %scratch)")
            w.do("ret void")
            w.place(whole)
        y: Callable[[str], str] = lambda i: self.at(w, space.solution, i)  # noqa: E731
        w.count("0", size, lambda i: w.put(w.get(self.at(w, space.right, i)), y(i)))

        def swap(k: str) -> None:
            row = w.get(w.at("%scratch", w.word_op("add", k, str(space.swaps)), "i64"), "i64")
            a, b = w.get(y(k)), w.get(y(row))
            w.put(b, y(k))
            w.put(a, y(row))

        def forward(i: str) -> None:
            self.subtract_products(w, i, "0", i)

        def backward(turn: str) -> None:
            i = w.word_op("sub", str(self.size - 1), turn)
            self.subtract_products(w, i, w.word_op("add", i, "1"), size)
            w.put(w.multiply(w.get(y(i)), w.get(self.at(w, space.pivots, i))), y(i))

        w.count("0", size, swap)
        w.count("0", size, forward)
        w.count("0", size, backward)
        w.do("ret void")
        return w.text("define internal void @solve_linear(ptr %scratch) noinline")

    def subtract_products(self, w: Routine, row: str, start: str, stop: str) -> None:
        """``solution[row] -= sum_j matrix[row][j] solution[j]`` for ``j = start … stop - 1``."""
        target = self.at(w, self.space.solution, row)
        total = w.variable("double", w.get(target))

        def term(j: str) -> None:
            known = w.negate(w.get(self.at(w, self.space.solution, j)))
            w.put(w.fma(w.get(self.entry(w, row, j)), known, w.get(total)), total)

        w.count(start, stop, term)
        w.put(w.get(total), target)


class _Sparse:
    """Elimination along a plan: its places are constants of the module, its loops run over them."""

    def __init__(self, module: Module, space: LinearSpace, plan: Elimination, diagonal: float) -> None:
        self.module = module
        self.space = space
        self.size = str(space.size)
        flat = [pair for row in plan.entries for pair in row]
        self.entry = constant_integers(module, "entry.of", [entry for entry, _ in flat])
        self.entry_place = constant_integers(module, "entry.place", [place for _, place in flat])
        self.entry_ends = constant_integers(module, "entry.ends", _ends(plan.entries))
        self.lower = constant_integers(module, "lower.place", [k for row in plan.lower for k in row])
        self.lower_ends = constant_integers(module, "lower.ends", _ends(plan.lower))
        # Numbers of U lie after those of L.
        first = sum(map(len, plan.lower))
        self.upper = constant_integers(
            module, "upper.place", [0] * first + [k for row in plan.upper for k in row]
        )
        self.upper_ends = constant_integers(module, "upper.ends", [first + end for end in _ends(plan.upper)])
        self.equations = constant_integers(module, "equation.of", plan.equations)
        self.columns = constant_integers(module, "unknown.of", plan.columns)
        numbers = (number_text(diagonal if column < space.n else 0.0) for column in plan.columns)
        parts = ", ".join(f"double {number}" for number in numbers)
        module.add("diagonal.of", f"@diagonal.of = internal constant [{space.size} x double] [{parts}]")

    def at(self, w: Routine, place: int, index: str) -> str:
        return w.at("%scratch", w.word_op("add", index, str(place)))

    def integer(self, w: Routine, array: str, index: str) -> str:
        return w.get(w.at(array, index, "i64"), "i64")

    def along(self, w: Routine, ends: str, row: str, write: Callable[[str], None]) -> None:
        """For every entry of a row."""
        w.count(self.integer(w, ends, row), self.integer(w, ends, w.word_op("add", row, "1")), write)

    def factor(self) -> str:
        w, space = Routine(self.module), self.space
        w.put("0", w.at("%scratch", space.whole, "i64"), "i64")
        minus_h = w.negate("%h")
        work: Callable[[str], str] = lambda place: self.at(w, space.work, place)  # noqa: E731
        zero = number_text(0.0)

        def row(i: str) -> None:
            for places, ends in ((self.lower, self.lower_ends), (self.upper, self.upper_ends)):
                self.along(w, ends, i, lambda k: w.put(zero, work(self.integer(w, places, k))))  # noqa: B023
            w.put(w.get(w.at("@diagonal.of", i)), work(i))

            def take(k: str) -> None:
                target = work(self.integer(w, self.entry_place, k))
                value = w.get(self.at(w, space.J, self.integer(w, self.entry, k)))
                w.put(w.fma(minus_h, value, w.get(target)), target)

            def eliminate(k: str) -> None:
                before = self.integer(w, self.lower, k)
                factor = w.multiply(w.get(work(before)), w.get(self.at(w, space.pivots, before)))
                w.put(factor, self.at(w, space.lower, k))
                minus = w.negate(factor)

                def subtract(m: str) -> None:
                    target = work(self.integer(w, self.upper, m))
                    w.put(w.fma(minus, w.get(self.at(w, space.lower, m)), w.get(target)), target)

                self.along(w, self.upper_ends, before, subtract)

            def keep(k: str) -> None:
                w.put(w.get(work(self.integer(w, self.upper, k))), self.at(w, space.lower, k))

            self.along(w, self.entry_ends, i, take)
            self.along(w, self.lower_ends, i, eliminate)
            self.along(w, self.upper_ends, i, keep)
            w.put(w.divide(number_text(1.0), w.get(work(i))), self.at(w, space.pivots, i))

        w.count("0", self.size, row)
        w.do("ret void")
        return w.text("define internal void @factor(ptr %scratch, double %h) noinline")

    def solve(self) -> str:
        w, space = Routine(self.module), self.space
        y: Callable[[str], str] = lambda place: self.at(w, space.work, place)  # noqa: E731

        def subtract_all(i: str, ends: str, places: str, start: str) -> str:
            total = w.variable("double", start)

            def term(k: str) -> None:
                known = w.negate(w.get(y(self.integer(w, places, k))))
                w.put(w.fma(w.get(self.at(w, space.lower, k)), known, w.get(total)), total)

            self.along(w, ends, i, term)
            return w.get(total)

        def forward(i: str) -> None:
            right = w.get(self.at(w, space.right, self.integer(w, self.equations, i)))
            w.put(subtract_all(i, self.lower_ends, self.lower, right), y(i))

        def backward(turn: str) -> None:
            i = w.word_op("sub", str(space.size - 1), turn)
            total = subtract_all(i, self.upper_ends, self.upper, w.get(y(i)))
            value = w.multiply(total, w.get(self.at(w, space.pivots, i)))
            w.put(value, y(i))
            w.put(value, self.at(w, space.solution, self.integer(w, self.columns, i)))

        w.count("0", self.size, forward)
        w.count("0", self.size, backward)
        w.do("ret void")
        return w.text("define internal void @solve_sparse(ptr %scratch) noinline")

    def solved_well(self) -> str:
        """Whether no row of the solved equations leaves more over than a part of its own terms' sizes."""
        w, space = Routine(self.module), self.space
        good = w.variable("i1", "true")
        minus_h = w.negate("%h")

        def row(i: str) -> None:
            right = w.get(self.at(w, space.right, self.integer(w, self.equations, i)))
            own = w.get(self.at(w, space.solution, self.integer(w, self.columns, i)))
            product = w.multiply(w.get(w.at("@diagonal.of", i)), own)
            rest = w.variable("double", w.subtract(right, product))
            terms = w.variable("double", w.add(w.absolute(right), w.absolute(product)))

            def term(k: str) -> None:
                coefficient = w.multiply(minus_h, w.get(self.at(w, space.J, self.integer(w, self.entry, k))))
                place = self.integer(w, self.entry_place, k)
                value = w.get(self.at(w, space.solution, self.integer(w, self.columns, place)))
                part = w.multiply(coefficient, value)
                w.put(w.subtract(w.get(rest), part), rest)
                w.put(w.add(w.get(terms), w.absolute(part)), terms)

            self.along(w, self.entry_ends, i, term)
            small = w.compare(
                "ole", w.absolute(w.get(rest)), w.multiply(number_text(LEFT_OVER), w.get(terms))
            )
            w.put(w.both(w.get(good, "i1"), small), good, "i1")

        w.count("0", self.size, row)
        w.do(f"ret i1 {w.get(good, 'i1')}")
        return w.text("define internal i1 @solved_well(ptr %scratch, double %h) noinline")


def _ends(rows: Sequence[Sequence[object]]) -> list[int]:
    """Where each row begins in all of them put together, and the end of the last."""
    ends = [0]
    for row in rows:
        ends.append(ends[-1] + len(row))
    return ends
