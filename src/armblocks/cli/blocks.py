"""``armblocks blocks``: lists all blocks by family, or shows one block with an example."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from armblocks.cli.terminal import STRONG, results_console, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from armblocks.diagram import Block, Parameter, Port


def describe_blocks(
    name: Annotated[str | None, typer.Argument(help="A block, by its type or title; by default all.")] = None,
    search: Annotated[
        str | None,
        typer.Option("--search", metavar="TEXT", help="Only blocks whose documentation contains TEXT."),
    ] = None,
    save: Annotated[
        Path | None,
        typer.Option("--save", metavar="FILE.json", help="Write the block's example, for 'armblocks run'."),
    ] = None,
) -> None:
    """List the blocks, or show the equation, ports, units, parameters and an example of one block."""
    from armblocks.errors import InputError

    console = results_console()
    if name is not None and search is not None:
        raise InputError(
            f"the block '{name}' and the search '{search}' are both given",
            allowed="a block's name or --search",
            fix="omit one of them",
            where="armblocks blocks",
        )
    if name is None and save is not None:
        raise InputError(
            "--save needs a block",
            allowed="armblocks blocks NAME --save FILE",
            fix="give the name of a block",
            where="armblocks blocks",
        )
    if name is None:
        _list(console, search)
    elif save is not None:
        _save(console, _block_type(name), save)
    else:
        _show(console, _block_type(name))


def _block_type(name: str) -> type[Block]:
    """The block of this type name or title, in any case."""
    from armblocks.blocks import BLOCKS
    from armblocks.errors import UnknownNameError

    by_title = {kind.title.casefold(): kind for kind in BLOCKS.values()}
    by_name = {kind.type_name().casefold(): kind for kind in BLOCKS.values()}
    kind = by_name.get(name.casefold()) or by_title.get(name.casefold())
    if kind is None:
        raise UnknownNameError("block", name, BLOCKS)
    return kind


def _list(console: Console, search: str | None) -> None:
    from armblocks.blocks import BLOCKS
    from armblocks.errors import InputError

    kinds = [kind for kind in BLOCKS.values() if search is None or _contains(kind, search)]
    if not kinds:
        raise InputError(
            f"no block's documentation contains '{search}'",
            allowed="part of a word of a block's name, title or documentation",
            fix="list them all with 'armblocks blocks'",
            where="armblocks blocks --search",
        )
    console.print(blocks_table(kinds))
    console.print(Text(f"\n{len(kinds)} blocks. 'armblocks blocks NAME' shows one, with an example."))


def _contains(kind: type[Block], search: str) -> bool:
    from armblocks.blocks import BLOCKS

    words = (kind.type_name(), kind.title, BLOCKS.family_of(kind), inspect.cleandoc(kind.__doc__ or ""))
    query = " ".join(search.casefold().split())
    return any(query in " ".join(text.casefold().split()) for text in words)


def blocks_table(kinds: list[type[Block]]) -> Table:
    """A table with one line for each block, grouped by family."""
    from armblocks.blocks import BLOCKS

    rows = table(("block", "left"), ("description", "left"))
    for family, members in BLOCKS.families.items():
        listed_kinds = [kind for kind in members if kind in kinds]
        if listed_kinds:
            rows.add_row(Text(f"\n{family}", STRONG))
        for kind in listed_kinds:
            rows.add_row(kind.type_name(), kind.summary())
    return rows


def _save(console: Console, kind: type[Block], path: Path) -> None:
    import armblocks as ab

    ab.save_diagram(ab.block_example(kind), path)
    console.print(f"wrote {path}; 'armblocks run {path}' runs it", soft_wrap=True)


def _show(console: Console, kind: type[Block]) -> None:
    from armblocks.blocks import BLOCKS
    from armblocks.face.block_examples import block_example, caption, example_block
    from armblocks.formats import diagram_to_python

    block = example_block(kind)
    console.print(Text.assemble((kind.type_name(), STRONG), f"  ({kind.title}; {BLOCKS.family_of(kind)})"))
    for line in _paragraphs(kind):
        console.print(line)
    if frames := block.frame_ports():
        rows = table(("frame ports", "left"), ("description", "left"))
        for frame in frames:
            rows.add_row(frame.name, frame.doc)
        console.print()
        console.print(rows)
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
    console.print(Text.assemble(("\nexample  ", STRONG), caption(kind)))
    code = diagram_to_python(block_example(kind)).splitlines()
    console.print(Text("\n" + "\n".join(f"    {line}" if line else "" for line in code)), soft_wrap=True)
    save = f"{kind.type_name()}.json"
    console.print(
        Text(f"\nrun it   armblocks blocks {kind.type_name()} --save {save} && armblocks run {save}"),
        soft_wrap=True,
    )


def _paragraphs(kind: type[Block]) -> list[RenderableType]:
    """The documentation for a terminal: each paragraph after an empty line, lists with a hanging indent."""
    paragraphs: list[RenderableType] = []
    for paragraph in kind.documentation():
        text = paragraph.replace("``", "")
        if not text.startswith("- "):
            paragraphs.append(Text("\n" + text))
            continue
        entries = Table.grid(padding=(0, 1))
        for entry in text.splitlines():
            entries.add_row("-", Text(entry.removeprefix("- ")))
        paragraphs += [Text(""), entries]
    return paragraphs


def _ports(title: str, ports: tuple[Port, ...]) -> Table:
    rows = table((title, "left"), ("shape", "left"), ("unit", "left"), ("description", "left"))
    for port in ports:
        rows.add_row(port.name, shape_text(port), port.unit, port.doc)
    return rows


def shape_text(port: Port) -> str:
    """The shape of a port as text: ``any``, ``scalar``, ``3``, ``4 x 4``."""
    if port.shape is None:
        return "any"
    return " x ".join(map(str, port.shape)) or "scalar"


def _parameters(rules: tuple[Parameter, ...]) -> Table:
    rows = table(("parameter", "left"), ("default", "left"), ("unit", "left"), ("description", "left"))
    for rule in rules:
        default = "none" if rule.required else str(rule.default)
        doc = f"{rule.doc}: {rule.describe()}" if rule.choices else rule.doc
        rows.add_row(rule.name, default, rule.unit, f"{doc}{' (tunable)' if rule.tunable else ''}")
    return rows
