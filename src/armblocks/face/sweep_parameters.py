"""The parameters of the runs of a sweep: values of tunable parameters, and models with other constants."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import Diagram, content_key, with_parameters
from armblocks.diagram.block import Block
from armblocks.diagram.variation import found_block
from armblocks.equations import Signature, Slot
from armblocks.errors import ArmblocksError, DiagramError, InputError, UnknownNameError
from armblocks.face.diagram_run import tuned_parameters
from armblocks.face.model import CompiledDiagram
from armblocks.simulation.plan import changed_parameters
from armblocks.sweeps.designs import Column, Design, combinations

Array = NDArray[np.float64]

MAX_STRUCTURES = 200
"""Maximum number of models that are compiled in one sweep."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Variant:
    """A compiled model, and the values of its parameters ``(np,)`` that the runs of a group share."""

    model: CompiledDiagram
    parameters: Array


class RunParameters:
    """The parameters of all runs of a design.

    Fast columns are tunable parameters of single blocks: their values are inputs of the compiled system.
    The values of other columns, such as mask parameters, are evaluated once for each combination; parameters
    that are constants of the equations need a new compilation for each combination.
    """

    def __init__(self, model: CompiledDiagram, design: Design) -> None:
        """Checks all values. Raises ``UnknownNameError``, ``DiagramError`` and ``InputError``."""
        self._model = model
        self.design = design
        with_parameters(model.diagram, self.values(0))  # raises errors for unknown and for fixed parameters
        layout = model.compiled.parameters
        fast = {name: column for name, column in design.columns.items() if _fast(name, column, layout)}
        self._fast = self._verified(fast)
        self._check_values()
        slow = [name for name in design.columns if name not in self._fast]
        made: tuple[list[Variant], NDArray[np.intp]] = self._make_variants(slow)
        self.variants, self._numbers = made

    @property
    def recompiled(self) -> int:
        """The number of models that are compiled because of other constants of the equations."""
        return len({id(variant.model) for variant in self.variants if variant.model is not self._model})

    @property
    def digest(self) -> str:
        """A digest of the models and parameters of all runs; empty if the content of a model is unknown."""
        content = hashlib.sha256(self.design.digest.encode())
        content.update(self._numbers.astype(np.int64).tobytes())
        for variant in self.variants:
            if variant.model is self._model:
                changed = np.flatnonzero(variant.parameters != self._model.compiled.parameter_values)
                content.update(changed.astype(np.int64).tobytes() + variant.parameters[changed].tobytes())
                continue
            key = content_key(variant.model.diagram)
            if key is None:
                return ""
            content.update(key.encode())
        return content.hexdigest()

    def values(self, run: int) -> dict[str, Any]:
        """The values of one run by parameter, as :func:`armblocks.simulate` accepts them."""
        return values_of_run(self._model.diagram, self.design, run)

    def groups(self, begin: int, end: int) -> list[tuple[Variant, NDArray[np.intp], Array]]:
        """The runs ``begin`` to ``end - 1`` by variant: their indices in this range, and their parameters."""
        numbers = self._numbers[begin:end]
        groups: list[tuple[Variant, NDArray[np.intp], Array]] = []
        for number in np.unique(numbers):
            variant, places = self.variants[int(number)], np.flatnonzero(numbers == number)
            groups.append((variant, places, self._parameters(variant, begin + places)))
        return groups

    def _parameters(self, variant: Variant, runs: NDArray[np.intp]) -> Array:
        """The parameters of runs of one variant, ``(n, np)``."""
        layout = variant.model.compiled.parameters
        p = np.tile(variant.parameters, (runs.size, 1))
        for name in self._fast:
            column = self.design.columns[name]
            if _whole(name) not in layout.ranges:
                continue  # the compiled model of this variant does not contain the parameter
            p[:, _places(name, layout)] = column[runs].reshape(runs.size, -1)
        return p

    def _verified(self, fast: Mapping[str, Column]) -> list[str]:
        """The columns that are entries of the parameter vector.

        The first, the middle and the last run are compared with the parameters of a changed diagram. If they
        differ, there are no such columns.
        """
        base = Variant(model=self._model, parameters=self._model.compiled.parameter_values)
        others = [name for name in self.design.columns if name not in fast]
        checked = {_block_of(name) for name in others}
        names = [name for name in fast if _block_of(name) not in checked]
        if others:  # a parameter may be checked together with one that depends on a mask parameter
            diagram = self._model.diagram
            names = [name for name in names if not _checks_together(_found(diagram, name))]
        if not names:
            return []
        self._fast = names
        for run in {0, self.design.count // 2, self.design.count - 1}:
            values = {
                k: v for k, v in self.values(run).items() if any(_whole(n) == k or n == k for n in names)
            }
            tuned = _tuned(self._model, self._changed(values, run))
            expected = None if tuned is None else tuned.parameters
            given = self._parameters(base, np.array([run]))[0]
            if expected is None or expected.tobytes() != given.tobytes():
                return []
        return names

    def _changed(self, values: Mapping[str, Any], run: int) -> Diagram:
        """The diagram with other values. The errors name the run."""
        try:
            return with_parameters(self._model.diagram, values)
        except UnknownNameError:
            raise
        except ArmblocksError as error:
            raise _of_run(error, run) from None

    def _check_values(self) -> None:
        """Check the values of fast columns: each value by its rule, the values of a block together."""
        blocks: dict[str, list[str]] = {}
        for name in self._fast:
            blocks.setdefault(_block_of(name), []).append(name)
        for path, names in blocks.items():
            block = _found(self._model.diagram, names[0])
            rules = {rule.name: rule for rule in block.own_parameters()}
            for name in names:
                rule = rules[_whole(name).rpartition(".")[2]]
                column = self.design.columns[name]
                low = (column < rule.minimum) | (column > rule.maximum)
                if rule.above is not None:
                    low |= column <= rule.above
                invalid = np.flatnonzero(low.reshape(len(column), -1).any(axis=1))
                if invalid.size:
                    run = int(invalid[0])
                    self._changed({_whole(name): self.values(run)[_whole(name)]}, run)
            if not _checks_together(block):
                continue
            self._check_block(block, path, names)

    def _check_block(self, block: Block, path: str, names: Sequence[str]) -> None:
        """Check the values of one block together. The rules of single parameters are checked already, so
        that a copy of the block with other values is enough."""
        fields = {entry.name: getattr(block, entry.name) for entry in dataclasses.fields(block)}
        if not _reads_any(block, fields, {_whole(name).rpartition(".")[2] for name in names}):
            return
        columns = [self.design.columns[name] for name in names]
        parameters = [name.rpartition(".")[2] for name in names]
        entries = any(name.endswith("]") for name in names)
        wholes = list(dict.fromkeys(map(_whole, names)))
        changed: Any = object.__new__(cast("Any", type(block)))
        for run in _different_runs(columns):
            if entries:
                row = self.values(run)
                values = {whole.rpartition(".")[2]: row[whole] for whole in wholes}
            else:
                values = {name: column[run].tolist() for name, column in zip(parameters, columns)}
            changed.__dict__.clear()
            changed.__dict__.update(fields)
            changed.__dict__.update({name: _canonical(value) for name, value in values.items()})
            try:
                changed.check()
            except InputError as error:
                raise _of_run(error, run, f"block '{path}'") from None

    def _make_variants(self, slow: Sequence[str]) -> tuple[list[Variant], NDArray[np.intp]]:
        """The variants for all combinations of the slow columns, and the number of each run's variant."""
        base = self._model.compiled.parameter_values
        if not slow:
            one = Variant(model=self._model, parameters=base)
            return [one], np.zeros(self.design.count, dtype=np.intp)
        first, numbers = combinations([self.design.columns[name] for name in slow])
        wholes = {_whole(name) for name in slow} | set(slow)
        variants: list[Variant] = []
        structures = 0
        for run in first:
            values = {name: value for name, value in self.values(run).items() if name in wholes}
            changed = self._changed(values, run)
            tuned = _tuned(self._model, changed)
            if tuned is None:
                structures += 1
                if structures > MAX_STRUCTURES:
                    raise InputError(
                        f"the sweep varies constants of the equations ({', '.join(slow)}) and needs more "
                        f"than {MAX_STRUCTURES} compilations",
                        where=self._model.diagram.name,
                        allowed=f"at most {MAX_STRUCTURES} different combinations of parameters that are "
                        "constants of the equations",
                        fix="vary these parameters in a short list, or vary tunable parameters",
                    )
                model = CompiledDiagram(changed)
                tuned = Variant(model=model, parameters=model.compiled.parameter_values)
            variants.append(tuned)
        return variants, numbers


def values_of_run(diagram: Diagram, design: Design, run: int) -> dict[str, Any]:
    """The values of one run by parameter, as :func:`armblocks.simulate` accepts them.

    Raises ``UnknownNameError`` for an entry that does not exist.
    """
    row = design.row(run)
    values: dict[str, Any] = {}
    for name, value in row.items():
        path = _whole(name)
        if path == name or _is_parameter(diagram, name):
            values[name] = value
            continue
        array = np.asarray(values.get(path, _present_value(diagram, path)), dtype=np.float64)
        slot = Slot(path, array.shape)
        if name not in slot.elements:
            raise UnknownNameError("parameter", name, slot.elements, where=diagram.name)
        flat = array.reshape(-1).copy()
        flat[slot.elements.index(name)] = value
        values[path] = flat.reshape(array.shape).tolist()
    return values


def parameter_unit(diagram: Diagram, name: str) -> str:
    """The unit of a varied parameter ``block.parameter`` or ``block.parameter[k]``; empty if it has none."""
    if not _block_of(name):
        return ""
    rules = {rule.name: rule.unit for rule in _found(diagram, name).own_parameters()}
    return rules.get(_whole(name).rpartition(".")[2], "")


def _tuned(model: CompiledDiagram, changed: Diagram) -> Variant | None:
    """The variant with the parameters of a changed diagram; ``None`` if its equations differ."""
    tuned = tuned_parameters(model.diagram, changed)
    if tuned is None:
        return None
    compiled = model.compiled
    parameters = changed_parameters(compiled, compiled.parameter_values, tuned)
    return Variant(model=model, parameters=parameters)


def _of_run(error: ArmblocksError, run: int, where: str = "") -> DiagramError:
    """The error for a value, with the number of the run."""
    place = ", ".join(filter(None, (where, error.where, f"run {run}")))
    return DiagramError(error.what, where=place, allowed=error.allowed, fix=error.fix)


def _reads_any(block: Block, fields: Mapping[str, Any], parameters: Collection[str]) -> bool:
    """Whether the check of a block reads one of these parameters. If it does not, the valid values of the
    block show that it is valid for all values of these parameters."""
    read: set[str] = set()

    def recorded(self: Any, name: str) -> Any:
        read.add(name)
        return object.__getattribute__(self, name)

    kind: Any = type(block)
    members = {"__getattribute__": recorded, "__module__": kind.__module__}
    recorder: Any = type(kind)(kind.__name__, (kind,), members)
    copy: Any = object.__new__(recorder)
    object.__getattribute__(copy, "__dict__").update(fields)
    copy.check()
    return "__dict__" in read or not read.isdisjoint(parameters)


def _different_runs(columns: Sequence[Column]) -> Iterable[int]:
    """The first run with each value of a single column of numbers; all runs for several columns."""
    first = columns[0]
    if len(columns) > 1 or first.ndim > 1:
        return range(len(first))
    return np.sort(np.unique(first.astype(np.float64).view(np.int64), return_index=True)[1]).tolist()


def _canonical(value: Any) -> Any:
    """A number as float, an array as nested tuples, as blocks have them."""
    return tuple(map(_canonical, cast("list[Any]", value))) if isinstance(value, list) else float(value)


def _whole(name: str) -> str:
    """The path of the parameter of an entry ``block.parameter[k]``."""
    return name.rpartition("[")[0] if name.endswith("]") else name


def _block_of(name: str) -> str:
    return _whole(name).rpartition(".")[0]


def _found(diagram: Diagram, name: str) -> Block:
    _, level, block = found_block(diagram, _block_of(name))
    return level.block(block)


def _is_parameter(diagram: Diagram, name: str) -> bool:
    """Whether a name with brackets is the name of a parameter."""
    return not _block_of(name) and name in diagram.mask_values


def _present_value(diagram: Diagram, path: str) -> Any:
    block, _, parameter = path.rpartition(".")
    if not block:
        return diagram.mask_values[parameter]
    found = _found(diagram, path)
    names = [rule.name for rule in found.own_parameters()]
    if parameter not in names:
        raise UnknownNameError("parameter", parameter, names, where=f"block '{block}'")
    return found.parameter_value(parameter)


def _fast(name: str, column: Column, layout: Signature) -> bool:
    """Whether a column can be written into the parameters of the compiled system directly."""
    path = _whole(name)
    if column.dtype == object or path not in layout.ranges or "." not in path:
        return False
    slot = layout[path]
    shape = column.shape[1:]
    return shape == slot.shape if name == path else shape == () and name in slot.elements


def _places(name: str, layout: Signature) -> slice:
    path = _whole(name)
    if name == path:
        return layout.ranges[path]
    start = layout.ranges[path].start + layout[path].elements.index(name)
    return slice(start, start + 1)


def _checks_together(block: Block) -> bool:
    """Whether a block checks several parameters together."""
    return type(block).check is not Block.check
