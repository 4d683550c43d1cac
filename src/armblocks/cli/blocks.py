"""``armblocks blocks NAME``: what a block does, its equation, ports, units and parameters, and an example."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from armblocks.cli.terminal import STRONG, results_console, table

if TYPE_CHECKING:
    from armblocks.diagram import Block, Parameter, Port
    from armblocks.equations import Shape

_EXAMPLE_ROBOT = "puma560"


def describe_block(
    name: Annotated[str, typer.Argument(help="The block, as 'armblocks list blocks' names it.")],
) -> None:
    """Show what a block does: its equation, ports, units, parameters, and how to use it from Python."""
    from armblocks.blocks import BLOCKS
    from armblocks.errors import UnknownNameError

    by_title = {kind.title.casefold(): kind for kind in BLOCKS.values()}
    by_name = {kind.type_name().casefold(): kind for kind in BLOCKS.values()}
    kind = by_name.get(name.casefold()) or by_title.get(name.casefold())
    if kind is None:
        raise UnknownNameError("block", name, BLOCKS)
    _show(results_console(), kind)


def _show(console: Console, kind: type[Block]) -> None:
    block = kind(**_needed(kind))
    paragraphs = inspect.cleandoc(kind.__doc__ or "").replace("``", "").split("\n\n")
    console.print(Text.assemble((kind.type_name(), STRONG), f"  ({kind.title}; {kind.family})"))
    for paragraph in paragraphs:
        console.print(Text("\n" + " ".join(paragraph.split())))
    for title, ports in (
        ("inputs", block.input_ports()),
        ("outputs", block.output_ports()),
        ("recorded", block.record_ports()),
    ):
        if ports:
            console.print()
            console.print(_ports(title, ports))
    if kind.parameters():
        console.print()
        console.print(_parameters(kind.parameters()))
    console.print(Text("\nexample", STRONG))
    console.print(Text(example(kind)), soft_wrap=True)


def example(kind: type[Block]) -> str:
    """A few lines of Python that put the block, with its defaults, into a diagram."""
    needed = _needed(kind)
    values = _fitting_values(kind(**needed))
    name = kind.type_name()
    stated = [f"{key}=robot" for key in needed]
    # A sample time that is inherited by default has nobody to inherit it from here.
    stated += [f"{rule.name}=0.1" for rule in kind.parameters() if rule.name == "sample_time"]
    arguments = ", ".join(stated)
    sources = "".join(f", {port}" for port in values)
    lines = ["import armblocks as ab", f"from armblocks.blocks import {_imports(kind, bool(values))}", ""]
    if needed:
        lines.append(f'robot = ab.load_robot("{_EXAMPLE_ROBOT}").robot')
    lines.append('builder = ab.DiagramBuilder("example")')
    lines += [f'{port} = builder.add("{port}", Constant(value={value}))' for port, value in values.items()]
    lines.append(f'block = builder.add("block", {name}({arguments}){sources})')
    lines.append("result = ab.simulate(builder.build(), stop_time=1.0)")
    return "\n".join(f"    {line}" if line else "" for line in lines)


def _needed(kind: type[Block]) -> dict[str, Any]:
    """The shipped robot for the parameters that have no default."""
    rules = [rule for rule in kind.parameters() if rule.required]
    if not rules:
        return {}
    import warnings

    import armblocks as ab
    from armblocks.errors import InertiaWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        robot = ab.load_robot(_EXAMPLE_ROBOT).robot
    return {rule.name: robot for rule in rules}


def _imports(kind: type[Block], fed: bool) -> str:
    return ", ".join(sorted({kind.type_name(), *(["Constant"] if fed else [])}))


def _fitting_values(block: Block) -> dict[str, Any]:
    """Values by input port, of the first of a few shapes that the block takes where a port leaves it open."""
    from armblocks.errors import InputError

    tried: dict[str, Any] = {}
    for open_shape in ((), (2,), (3, 3)):
        shapes = {port.name: open_shape if port.shape is None else port.shape for port in block.input_ports()}
        tried = {name: _value(shape) for name, shape in shapes.items()}
        try:
            block.output_shapes(shapes)
        except InputError:
            continue
        return tried
    return tried


def _value(shape: Shape) -> Any:
    """The identity where the shape is a square matrix, else rising numbers."""
    if len(shape) == 2:
        return [[1.0 if i == j else 0.0 for j in range(shape[1])] for i in range(shape[0])]
    return [0.5 * k for k in range(1, shape[0] + 1)] if shape else 1.0


def _ports(title: str, ports: tuple[Port, ...]) -> Table:
    rows = table((title, "left"), ("shape", "left"), ("unit", "left"), ("what it is", "left"))
    for port in ports:
        rows.add_row(port.name, "any" if port.shape is None else str(port.shape), port.unit, port.doc)
    return rows


def _parameters(rules: tuple[Parameter, ...]) -> Table:
    rows = table(("parameter", "left"), ("default", "left"), ("unit", "left"), ("what it is", "left"))
    for rule in rules:
        default = "none" if rule.required else str(rule.default)
        doc = f"{rule.doc}: {rule.describe()}" if rule.choices else rule.doc
        rows.add_row(rule.name, default, rule.unit, f"{doc}{' (tunable)' if rule.tunable else ''}")
    return rows
