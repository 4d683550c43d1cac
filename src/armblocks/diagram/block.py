"""The base class of blocks: frozen parameters and pure equations over ``t, x, u, p``, without state."""

from __future__ import annotations

import dataclasses
import inspect
import re
from abc import ABC
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ClassVar, Self

from casadi import SX, logic_or

from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram.frames import FramePort
from armblocks.diagram.mask import ParameterFormula, Scope, formula_names, formula_value
from armblocks.diagram.parameter import Parameter, Value, shape_of
from armblocks.diagram.port import Condition, DelayLine, Guard, Port, State, View, name_before
from armblocks.diagram.shape_rules import broadcast
from armblocks.diagram.signs import FaceSign, Outline, Title, value_text
from armblocks.diagram.worked_example import WorkedExample
from armblocks.equations import Shape
from armblocks.errors import UnknownNameError

_MAX_FORMULA_LENGTH = 16
"""Maximum number of characters of a formula that a block's face shows instead of the value."""
Shapes = Mapping[str, Shape]
"""Shapes by port name."""
Signals = Mapping[str, SX]
"""Symbolic values by name, each in its natural shape: scalar 1x1, vector a column, matrix unchanged."""


@dataclass(frozen=True, kw_only=True)
class Block(ABC, metaclass=ArgumentErrors, methods=False):
    """Base class of block types. Subclasses are final frozen dataclasses whose fields are parameters.

    A subclass sets ``title``, declares its parameters with :func:`~armblocks.diagram.parameter.parameter`,
    and overrides the methods for its ports, states and equations. In the equations ``t`` is the time (s),
    ``x`` the block's states of all kinds, ``u`` its inputs, ``p`` its tunable parameters, all symbolic; the
    other parameters are plain attributes. An equation must not read a tunable parameter from ``self``, only
    from ``p``: the compiled system can run with other values.

    A *sampled* block (``sampled = True``, parameter ``sample_time``) is active at the ticks of its clock
    only. At a tick its outputs are computed from the previous discrete states and then held; ``updates``
    gives the next discrete states. Its equations read the time since the previous tick (s) as ``p["T"]``.
    In a triggered subsystem this time changes; see ``reads_next_period``.

    A block with *modes* switches between equations at *events*. A mode is constant between events, so that
    the continuous equations are smooth. ``guards`` gives the functions whose zeros are events and ``resets``
    the changes at events. ``mode_values`` gives the mode that is consistent with the present values (at the
    start, and in sampled parts of a diagram, which are evaluated at ticks only).

    Where a mode is just the sign of a quantity, the block declares *conditions* instead: ``condition_values``
    gives the quantity, the equations read 1 or 0 as ``x[name]``, and mode, guard and reset are generated. If
    all inputs are sampled or constant, conditions are evaluated directly, without a mode.

    A block may read delayed values of its inputs: ``delay_lines`` declares them and ``delay_times`` gives the
    delays. The equations read them as ``x[name]``; the integrator stores the history.

    A parameter may be given as a :func:`~armblocks.diagram.mask.formula` over the mask of the enclosing
    diagram. The diagram evaluates it; ``formulas`` keeps the text.

    The first line of a subclass's docstring describes the block in one sentence, with its equation.
    """

    title: ClassVar[str]
    """The displayed name of the block, as in Simulink or the toolbox: ``XY Graph``."""
    time_derivatives: ClassVar[Mapping[str, str]] = {}
    """Output ports that are the exact time derivative of an input: output name to input name.

    They have no equation: tracing differentiates the signal at the input."""
    output_rates: ClassVar[Mapping[str, str]] = {}
    """Outputs whose exact time derivative is another output: ``{"q": "qd"}``.

    A Derivative block with the input ``q`` then outputs exactly ``qd``. A joint at rest has exactly the speed
    0; a speed of 1e-17 would change the sign of Coulomb friction."""

    implicit_outputs: ClassVar[tuple[str, ...]] = ()
    """Implicit outputs: ``outputs`` returns their residual. The solver finds the value
    that makes it zero. Newton's method starts from ``initial_guesses``."""
    gathers: ClassVar[Callable[[Any], Any] | None] = None
    """The pass that converts all physical blocks of a family to equations, such as bodies and joints.

    The equations of a physical block follow from its network, and a family of such blocks is above the
    diagram layer: the blocks bring their pass, a function from a netlist to a netlist, which reads
    :meth:`part`. A physical block is virtual; see :mod:`armblocks.diagram.passes.physical_networks`."""
    sampled: ClassVar[bool] = False
    """Whether the block is sampled: active at the ticks of a clock, with the parameter ``sample_time``."""
    reads_next_period: ClassVar[bool] = False
    """Whether the updates of a sampled block read ``p["T_next"]``, the time (s) from this tick to the next.

    In a triggered subsystem the updates are then computed at the next trigger event, from the states and
    inputs of this one. Outputs do not read ``p["T_next"]``."""
    called: ClassVar[bool] = False
    """Whether a sampled block calls Python before each of its ticks. :meth:`call` takes the discrete states
    ``port?`` of the inputs at the tick and returns the discrete states of the outputs."""
    virtual: ClassVar[bool] = False
    """Whether the block represents connections only: it has no equations and is removed before tracing."""
    broadcast_parameters: ClassVar[tuple[str, ...]] = ()
    """Array parameters whose shape is broadcast with the input shapes to the output shape."""
    following_modes: ClassVar[bool] = False
    """Whether all modes are functions of the present signals, and all guards only locate their changes."""
    differentiated_inputs: ClassVar[tuple[str, ...]] = ()
    """Inputs whose exact time derivative the equations read, as ``u["name'"]``.

    The entry ``"name'"`` stands for the second derivative, ``u["name''"]``."""
    example: ClassVar[WorkedExample] = WorkedExample()
    """The worked example; by default the block gets inputs that fit its ports."""

    formulas: tuple[tuple[str, str], ...] = field(default=(), repr=False, metadata={"formulas": True})
    """The parameters that are formulas, by name, with their texts."""

    sign: ClassVar[FaceSign | None] = None
    """The sign on the block's face, if it does not depend on parameters; by default the title."""
    outline: ClassVar[Outline] = Outline.CARD
    """The block's outline, if it does not depend on parameters."""
    card_size: ClassVar[tuple[float, float] | None] = None
    """Width and height of a card, px; by default the size of the sign. Port names may widen it."""

    def __post_init__(self) -> None:
        formulas, unresolved = dict(self.formulas), False
        for rule in self.parameters():
            where = f"{type(self).__name__}.{rule.name}"
            value = getattr(self, rule.name)
            if isinstance(value, ParameterFormula):
                formulas[rule.name] = value.text
                if formula_names(value.text):
                    unresolved = True  # names are resolved in the diagram that contains the block
                    continue
                value = formula_value(rule, value.text, {}, type(self).__name__)
            object.__setattr__(self, rule.name, rule.check(value, where))
        object.__setattr__(self, "formulas", tuple(sorted(formulas.items())))
        if not unresolved:
            self.check()

    # -- description -------------------------------------------------------------------------------------

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """The parameters, in the order of declaration."""
        return _parameters_of(cls)

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        """The run inputs of the compiled system: tunable parameters and tables that are read by index."""
        return tuple(rule for rule in self.parameters() if rule.tunable)

    def parameters_behind_inputs(self) -> tuple[str, ...]:
        """Parameters that the equations replace by run inputs computed from them.

        The run input is an attribute of the block, not a parameter, and has the same name.
        """
        return ()

    def structure_of_the_run(self) -> tuple[Parameter, ...]:
        """The parameters that are constants of the equations; other parameters change without a new trace."""
        inputs, behind = self.inputs_of_the_run(), self.parameters_behind_inputs()
        return tuple(rule for rule in self.parameters() if rule not in inputs and rule.name not in behind)

    def face_outline(self) -> Outline:
        """The outline of the block's face."""
        return self.outline

    def face_sign(self) -> FaceSign:
        """The sign on the block's face."""
        return self.sign or Title(self.title)

    def stated_text(self, name: str) -> str:
        """The text of a parameter on the face: its formula if that is short, else its value."""
        text = dict(self.formulas).get(name, "")
        return text if 0 < len(text) <= _MAX_FORMULA_LENGTH else value_text(self.parameter_value(name))

    @classmethod
    def type_name(cls) -> str:
        """The name of this block type in files: the class name."""
        return cls.__name__

    @classmethod
    def summary(cls) -> str:
        """A one-sentence description: the first line of the docstring."""
        return (cls.__doc__ or "").strip().splitlines()[0]

    @classmethod
    def documentation(cls) -> tuple[str, ...]:
        """The paragraphs of the docstring.

        A paragraph of prose is one line. A list has one line for each entry, which begins with a hyphen. A
        formula has its lines, each with an indent of four spaces.
        """
        paragraphs: list[str] = []
        for paragraph in inspect.cleandoc(cls.__doc__ or "").split("\n\n"):
            if paragraph.startswith("    "):
                paragraphs.append(paragraph)
                continue
            entries = [" ".join(entry.split()) for entry in re.split(r"\n(?=- )", paragraph)]
            paragraphs.append(re.sub("::$", ":", "\n".join(entries)))
        return tuple(paragraphs)

    def own_parameters(self) -> tuple[Parameter, ...]:
        """The parameters of this block: of its type and, for a subsystem, of its mask."""
        return self.parameters()

    def parameter_value(self, name: str) -> Value:
        """The checked value of one parameter."""
        return getattr(self, name)

    def stated_value(self, name: str) -> Value | ParameterFormula:
        """The formula of a parameter if it has one, else its value."""
        text = dict(self.formulas).get(name)
        return self.parameter_value(name) if text is None else ParameterFormula(text)

    def with_parameters(self, **values: Any) -> Self:
        """The block with other values or formulas of some of its parameters.

        Raises ``UnknownNameError`` for an unknown parameter, ``InputError`` for an invalid value.
        """
        parameter_names = [rule.name for rule in self.own_parameters()]
        for name in values:
            if name not in parameter_names:
                raise UnknownNameError("parameter", name, parameter_names, where=self.type_name())
        texts = {name: value.text for name, value in values.items() if isinstance(value, ParameterFormula)}
        formulas = {name: text for name, text in self.formulas if name not in values} | texts
        plain = {name: value for name, value in values.items() if name not in texts}
        return self.replaced({**plain, "formulas": tuple(sorted(formulas.items()))})

    def in_scope(self, scope: Scope, where: str) -> Self:
        """The block with its formulas evaluated in a scope.

        Raises ``UnknownNameError`` for a name that is not in scope, ``InputError`` for an invalid value.
        """
        if not self.formulas:
            return self
        rules = {rule.name: rule for rule in self.own_parameters()}
        values: dict[str, Any] = {}
        for name, text in self.formulas:
            if name not in rules:
                raise UnknownNameError("parameter", name, rules, where=where)
            values[name] = formula_value(rules[name], text, scope, where)
        if all(self.parameter_value(name) == value for name, value in values.items()):
            return self
        return self.replaced(values)

    def replaced(self, values: Mapping[str, Any]) -> Self:
        """A copy with other parameter values; formulas that are not replaced are kept."""
        return dataclasses.replace(self, **values)

    def check(self) -> None:
        """Raise ``InputError`` for inconsistent parameters. Each single parameter is already checked."""

    # -- ports and states --------------------------------------------------------------------------------

    def input_ports(self) -> tuple[Port, ...]:
        """The input ports, in order."""
        return ()

    def output_ports(self) -> tuple[Port, ...]:
        """The output ports, in order."""
        return ()

    def frame_ports(self) -> tuple[FramePort, ...]:
        """The frame ports: physical connections without direction, see :mod:`armblocks.diagram.frames`."""
        return ()

    def part(self) -> object:
        """The contribution of a physical block to its network, as data that the pass ``gathers`` reads."""
        return None

    def bus_inputs(self) -> tuple[str, ...]:
        """Inputs that may be buses with equal elements, for blocks that select, delay or hold signals.

        The block is then copied for each signal, and every output is a bus of the copies' outputs.
        """
        return ()

    def record_ports(self) -> tuple[Port, ...]:
        """Signals that a run records as ``block/name`` but that cannot be connected.

        Their shape must be given.
        """
        return ()

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        """Continuous states, given the shapes of all inputs."""
        return ()

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        """States that only a tick (``updates``) or an event (``resets``) changes."""
        return ()

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        """Modes: they select the active equations and change at events; ``doc`` explains their values."""
        return ()

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        """Guards: quantities whose zero crossings are events."""
        return ()

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        """The conditions that the equations read; each may depend on those before it."""
        return ()

    def delay_lines(self, inputs: Shapes) -> tuple[DelayLine, ...]:
        """Delayed inputs that the equations read; each must be in ``differentiated_inputs`` too."""
        return ()

    def output_rate(self, port: str) -> str | None:
        """The output that is the exact time derivative of an output, by ``output_rates``."""
        return self.output_rates.get(port)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        """Shapes of the outputs whose port does not declare one, from the shapes of all inputs.

        By default, this is the broadcast shape of the parameters in ``broadcast_parameters`` and of the
        inputs without a declared shape. Raises ``InputError`` where the shapes do not fit.
        """
        names = [port.name for port in self.output_ports() if port.shape is None]
        if self.virtual or not names:
            return {}
        own = {port.name for port in self.input_ports() if port.shape is not None}
        wide = {name: shape for name, shape in inputs.items() if name not in own}
        for name in self.broadcast_parameters:
            wide[f"parameter {name}" if name in wide else name] = shape_of(self.parameter_value(name))
        return dict.fromkeys(names, broadcast(wide))

    def assumed_output_shapes(self) -> Shapes:
        """Shapes to assume for outputs in a loop before the inputs are known (an integrator's initial value).

        An assumed scalar may be widened to the shape that the inputs require.
        """
        return {}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        """SI units of outputs that follow from the inputs' units; a port's own unit is the default."""
        return {}

    def input_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        """SI units of inputs that follow from other inputs, such as the terms of a sum."""
        return {}

    def known_dependences(self) -> Mapping[str, Collection[str]] | None:
        """The inputs on which each output and record can depend, for checks without the equations.

        ``None``: they are read from the equations. Blocks with states, modes or delays return ``None``.
        """
        return None

    def reason_of_invalid_values(self) -> str:
        """Why signals or derivatives of the block can be NaN or infinite, for error messages of runs."""
        return ""

    def views(self) -> tuple[View, ...]:
        """The views of this block: sinks have one or more."""
        return ()

    # -- equations ---------------------------------------------------------------------------------------

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """Value of every output port, except the ports of ``time_derivatives``."""
        return {}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """Time derivative of every state, with the state's shape (a scalar is broadcast)."""
        return {}

    def records(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """Value of every record port. A stack (k, m, n) is given as a (k m, n) matrix."""
        return {}

    def initial_states(self, p: Signals) -> Signals:
        """Initial value of every continuous and discrete state (a scalar is broadcast)."""
        return {}

    def initial_outputs(self, p: Signals) -> Signals:
        """Held outputs of a sampled block before its first tick, where they are not 0."""
        return {}

    def initial_guesses(self, p: Signals) -> Signals:
        """Start value of the iteration for each of ``implicit_outputs``."""
        return {}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """The next value of every discrete state of a sampled block, at a tick."""
        return {}

    def call(self, t: float, inputs: Mapping[str, Any]) -> Mapping[str, Any]:
        """The outputs of a ``called`` block at a tick: numbers or arrays by port name.

        Raises ``InputError``.
        """
        return {}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """Value of every guard."""
        return {}

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """The quantity of every condition; the condition is 1 where it is positive."""
        return {}

    def delay_times(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """The delay (s) of each delay line, a scalar."""
        return {}

    def delay_bounds(self, p: Signals) -> Mapping[str, tuple[SX, SX]]:
        """The lower and upper limit of each delay (s), above 0; no step exceeds the lower limit."""
        return {}

    def initial_history(self, p: Signals) -> Signals:
        """The value of each delay line for times before the start."""
        return {}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """The consistent value of every mode at the present time.

        The mode is computed from the present values. For a stateful mode, ``x`` contains its present value.
        For a hysteresis mode, ``x`` contains its previous value: before the instant, or before the latest
        event at this instant.
        """
        return {}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """By mode, 1 where the mode is not consistent with the present values, else 0.

        An inconsistent mode takes the value of :meth:`mode_values`: after every jump, and at the first time
        within a step at which it is inconsistent. By default a mode is inconsistent where it differs from
        that value. Blocks override this where a mode may differ (hysteresis, counted edges), or where the
        test is cheaper than the value.
        """
        before = {mode: x[name_before(mode)] for mode in x if name_before(mode) in x}
        consistent = self.mode_values(t, {**x, **before}, u, p)
        return {name: logic_or(value > x[name], value < x[name]) for name, value in consistent.items()}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        """New values of the states and modes that an event may change.

        ``e``, by guard: +1 or -1 where it triggered upwards or downwards, else 0. If all are 0, the event
        belongs to another block; the result must then equal the old values, unless the present inputs or
        states require other values.
        """
        return {}

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """New values of discrete states that store left limits, taken just before a tick or event."""
        return {}

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        """Times (s) at which an output or its derivative jumps, as far as they follow from parameters.

        At a breakpoint, ``outputs`` gives the right limit. Its condition ``t >= time`` must use the same
        expression as here, because another expression may be rounded to another time.
        """
        return ()


@cache
def _parameters_of(kind: type[Block]) -> tuple[Parameter, ...]:
    fields = [entry for entry in dataclasses.fields(kind) if "formulas" not in entry.metadata]
    return tuple(dataclasses.replace(_declaration(entry), name=entry.name) for entry in fields)


def _declaration(field: dataclasses.Field[Any]) -> Parameter:
    # A plain field would be missing in files and dialogs: an error of the block's author.
    if "parameter" not in field.metadata:
        raise TypeError(f"field '{field.name}' of a block must be declared with parameter(...)")
    return field.metadata["parameter"]
