"""A page for every block: its description, ports and parameters, and a worked example with its plot."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Iterable, Iterator
from typing import cast

from light_pictures import simplified

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.diagram import (
    Block,
    Diagram,
    Parameter,
    ParameterKind,
    Port,
    State,
    ViewKind,
    diagram_views,
    infer_shapes,
)
from armblocks.drawing import block_picture, diagram_picture
from armblocks.face.block_examples import caption, example_block
from armblocks.formats import diagram_to_bytes, diagram_to_python, load_robot
from armblocks.pictures.picture import Picture
from armblocks.pictures.style import theme_variables
from armblocks.pictures.svg import page_rules, svg_inline
from armblocks.report.figures import Figure, motion_figures, view_figures
from armblocks.report.motion import Motion, motions

FIGURE_WIDTH = 736.0
"""Width of the theme's text column, px. Figures of this width have their nominal font size."""


MIN_SCALE = 0.6
"""Smallest scale of the drawing of a diagram, so that its names remain legible."""


def block_pages() -> Iterator[tuple[str, str]]:
    """Yield path and text of every page: the index, then a page for each block."""
    yield "blocks.md", index_page()
    for kind in BLOCKS.values():
        yield f"blocks/{kind.type_name()}.md", block_page(kind)


def index_page() -> str:
    """The index: every block of the library by family, with its symbol and its description."""
    lines = [
        "# Blocks",
        "",
        f"The library has {len(BLOCKS)} blocks. Each has a page with its equation, ports, parameters and a",
        "worked example: a small diagram, the Python program that builds it, and the results of a run.",
        "In a terminal, `armblocks blocks NAME` prints this information.",
        "",
    ]
    for family, kinds in BLOCKS.families.items():
        lines += [f"## {family.capitalize()}", "", '<div class="block-list">', ""]
        for kind in kinds:
            lines += [
                '<div class="block-entry">',
                f'<div class="symbol">{symbol(kind, "index")}</div><div>',
                "",
                f"[{kind.type_name()}](blocks/{kind.type_name()}.md){other_title(kind)}<br>",
                prose(kind.summary()),
                "",
                "</div></div>",
                "",
            ]
        lines += ["</div>", ""]
    return "\n".join(lines) + "\n"


def other_title(kind: type[Block]) -> str:
    """The displayed name of the block, if it differs from its type name."""
    same = kind.title.replace(" ", "").casefold() == kind.type_name().casefold()
    return "" if same else f" ({prose(kind.title)})"


def block_page(kind: type[Block]) -> str:
    """The page of one block."""
    block = example_block(kind)
    diagram = ab.block_example(kind)
    name = kind.type_name()
    family = BLOCKS.family_of(kind)
    name_in_studio = (
        f"Name in the studio: **{prose(kind.title)}**. " if other_title(kind) else ""
    )
    lines = [
        # Not in the table of contents, because the theme would list all blocks on the page of each block.
        "---",
        "orphan: true",
        "---",
        "",
        f"# {name}",
        "",
        f'<div class="symbol alone">{symbol(kind, name)}</div>',
        "",
        f"{name_in_studio}Family: [{family}](../blocks.md#{family}).",
        "",
        *docstring(kind),
        "",
        *worked_example(kind, diagram),
        *port_table(block),
        *parameter_table(kind),
        *behaviour(diagram),
    ]
    others = [other for other in BLOCKS.families[family] if other is not kind]
    if others:
        links = ", ".join(
            f"[{other.type_name()}]({other.type_name()}.md)" for other in others
        )
        text = (
            f"Other blocks of the family {family}: {links}. [All blocks](../blocks.md)."
        )
        lines += ["## See also", "", text, ""]
    return "\n".join(lines)


def symbol(kind: type[Block], page: str) -> str:
    """The block's face as SVG."""
    picture = block_picture(example_block(kind))
    size = f' style="width:{picture.width:.0f}px"'
    return svg_inline(picture, f"{page}-{kind.type_name()}").replace(
        "<svg ", f"<svg{size} ", 1
    )


def docstring(kind: type[Block]) -> list[str]:
    """The docstring as Markdown: paragraphs of prose, and indented formulas unchanged."""
    lines: list[str] = []
    for paragraph in kind.documentation():
        if paragraph.startswith("    "):
            lines += ["```text", inspect.cleandoc(paragraph), "```", ""]
        else:
            lines += [prose(paragraph), ""]
    return lines[:-1]


def prose(text: str) -> str:
    """The text of a docstring as Markdown; Markdown characters outside of code are escaped."""
    parts = re.split(r"(?::\w+:)?(`+)(.+?)\1", text)
    tokens = [
        re.sub(r"([*_\[\]|$<>#\\~])", r"\\\1", plain) + (f"`{code}`" if code else "")
        for plain, code in zip(parts[::3], [*parts[2::3], ""])
    ]
    return "".join(tokens)


def table(headings: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    """A Markdown table, followed by an empty line."""
    headings, cells = (
        list(headings),
        [[cell.replace("\n", " ") for cell in row] for row in rows],
    )
    # An empty column, such as the units of ports without units, is omitted.
    shown_columns = [k for k in range(len(headings)) if any(row[k] for row in cells)]
    headings, cells = (
        [headings[k] for k in shown_columns],
        [[row[k] for k in shown_columns] for row in cells],
    )
    body = ["| " + " | ".join(row) + " |" for row in cells]
    return ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings), *body, ""]


def port_table(block: Block) -> list[str]:
    """The inputs, the outputs, and the additional signals that a run records."""
    sides = (
        ("input", block.input_ports()),
        ("output", block.output_ports()),
        ("recorded", block.record_ports()),
    )
    rows = [
        (
            f"`{port.name}`",
            side,
            shape_text(port),
            unit_text(port.unit),
            prose(port.doc),
        )
        for side, ports in sides
        for port in ports
    ]
    rows += [
        (f"`{port.name}`", "frame", "", "", prose(port.doc))
        for port in block.frame_ports()
    ]
    return (
        ["## Ports", "", *table(("port", "side", "shape", "unit", "meaning"), rows)]
        if rows
        else []
    )


def shape_text(port: Port) -> str:
    """The shape of a port as text: ``any``, ``scalar``, ``3``, ``4 × 4``."""
    if port.shape is None:
        return "any"
    return " × ".join(map(str, port.shape)) or "scalar"


def parameter_table(kind: type[Block]) -> list[str]:
    """The parameters, their allowed values, and whether they are tunable."""
    if not kind.parameters():
        return []
    rows = [
        (
            f"`{rule.name}`",
            prose(allowed(rule)),
            unit_text(rule.unit),
            default_text(rule),
            "yes" if rule.tunable else "",
            prose(rule.doc),
        )
        for rule in kind.parameters()
    ]
    return [
        "## Parameters",
        "",
        *table(
            ("parameter", "allowed values", "unit", "default", "tunable", "meaning"),
            rows,
        ),
    ]


def allowed(rule: Parameter) -> str:
    """The allowed values as text, choices as code. Numbers are finite unless the text allows infinity."""
    if rule.kind is ParameterKind.CHOICE:
        return ", ".join(f"`{choice}`" for choice in rule.choices)
    words = rule.describe().removesuffix(", finite")
    if rule.kind is ParameterKind.ARRAY:
        shapes = " or ".join(
            ("number", "vector", "matrix", "table of three axes", "table of four axes")[
                n
            ]
            for n in rule.dimensions
        )
        words = ", ".join([shapes, *words.split(", ")[1:]])
    words = words.removeprefix("a ").removeprefix("an ")
    infinite = not rule.finite and rule.kind in (
        ParameterKind.NUMBER,
        ParameterKind.ARRAY,
    )
    words = f"{words}, may be infinite" if infinite else words
    return re.sub(
        "([<>]=?) ", "\\1\N{NO-BREAK SPACE}", words
    )  # no line break between sign and number


def unit_text(unit: str) -> str:
    """A unit as printed: ``rad/s2`` as rad/s², without line breaks."""
    powers = unit.replace("2", "²").replace("3", "³")
    return powers.replace(" ", "\N{NO-BREAK SPACE}")


def default_text(rule: Parameter) -> str:
    """The default as Python code: of a diagram the names of its blocks, of a function its name.

    Empty for a required parameter.
    """
    if rule.required:
        return ""
    if isinstance(rule.default, Diagram):
        return (
            f"a diagram of {' and '.join(f'`{name}`' for name in rule.default.blocks)}"
        )
    if callable(rule.default):
        return f"`{getattr(rule.default, '__name__', repr(rule.default))}`"
    return f"`{literal(rule.default)}`"


def literal(value: object) -> str:
    """A default as Python code: arrays as lists, and fractions of pi by name."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(literal, cast('tuple[object, ...]', value)))}]"
    if isinstance(value, float) and len(repr(value)) > 8:
        for divisor in (1, 2, 4):
            if abs(value) == math.pi / divisor:
                return ("-" if value < 0 else "") + (
                    "pi" if divisor == 1 else f"pi/{divisor}"
                )
    return repr(value)


def behaviour(diagram: Diagram) -> list[str]:
    """Lines about the states and events of the block, with the shapes of the example."""
    block = diagram.blocks[diagram.name]
    if block.virtual:
        return []  # a virtual block has no equations
    shapes = infer_shapes(diagram).inputs[diagram.name]
    states: list[tuple[str, State]] = [
        *(("continuous state", state) for state in block.states(shapes)),
        *(("discrete state", state) for state in block.discrete_states(shapes)),
        *(("mode", state) for state in block.modes(shapes)),
    ]
    rows = [
        (f"`{state.name}`", role, unit_text(state.unit), prose(state.doc))
        for role, state in states
    ]
    rows += [
        (
            f"`{guard.name}`",
            f"event {DIRECTIONS[guard.direction]}",
            "",
            prose(guard.doc),
        )
        for guard in block.guards(shapes)
    ]
    lines: list[str] = []
    if rows:
        lines = [
            "## States and events",
            "",
            *table(("name", "kind", "unit", "meaning"), rows),
        ]
    if block.sampled:
        text = (
            "The block is evaluated only at the ticks of its clock. "
            "Its outputs are held between the ticks."
        )
        lines += [text, ""]
    if block.time_derivatives:
        pairs = ", ".join(
            f"`{out}` is the exact time derivative of the signal at `{into}`"
            for out, into in block.time_derivatives.items()
        )
        lines += [f"{pairs}.", ""]
    return lines


DIRECTIONS = {
    1: "at an upward zero crossing",
    -1: "at a downward zero crossing",
    0: "at a zero crossing",
}


def has_shapes(motion: Motion, diagram: Diagram) -> bool:
    """Whether a drawing shows the motion: a drawn mechanism without solids has no shapes."""
    return not diagram.frame_lines or any(link.geometry for link in motion.robot.links)


def worked_example(kind: type[Block], diagram: Diagram) -> list[str]:
    """The example: its drawing, the results of a run, and its Python and JSON form."""
    result = ab.simulate(diagram)
    figures = list(view_figures(diagram, result, FIGURE_WIDTH))
    if any(view.kind is ViewKind.ROBOT for _, view in diagram_views(diagram)):
        figures += [
            next(motion_figures(motion, ""))
            for motion in motions(diagram, result)
            if has_shapes(motion, diagram)
        ]
    drawing = diagram_picture(diagram, result)
    lines = ["## Example", "", prose(caption(kind)), ""]
    lines += [figure_html(figure) for figure in figures]
    lines += [drawing_html(drawing, "diagram"), ""]
    lines += ["```python", diagram_to_python(diagram).rstrip(), "```", ""]
    data = diagram_to_bytes(diagram, load_robot).decode()
    lines += [
        "<details><summary>The example as a diagram file</summary>",
        "",
        "```text",  # syntax colours would triple the size of the page
        data.rstrip(),
        "```",
        "",
        "</details>",
        "",
    ]
    return lines


def drawing_html(drawing: Picture, name: str) -> str:
    """HTML of the drawing of a diagram; ``name`` is unique on the page.

    A drawing that is wider than the page is reduced to at most ``MIN_SCALE``; beyond it, the drawing scrolls.
    """
    size = f' style="width:{drawing.width:.0f}px;min-width:{MIN_SCALE * drawing.width:.0f}px"'
    svg = svg_inline(drawing, name).replace("<svg ", f"<svg{size} ", 1)
    return f'<figure class="drawing">{svg}</figure>'


def figure_html(figure: Figure) -> str:
    """HTML of a figure of the report."""
    shape = "narrow" if figure.narrow else "wide"
    svg = svg_inline(simplified(figure.picture), f"plot-{figure.name}")
    return f'<figure class="{shape}">{svg}</figure>\n'


def style_sheet() -> str:
    """CSS: colours of the figures for the selected theme, and the rules of the block pages.

    Pictures in separate files contain the colours of both themes and follow ``color-scheme`` of the page.
    """
    light, dark = (
        f"color-scheme:{theme};{theme_variables(theme)}" for theme in ("light", "dark")
    )
    return (
        f"body{{{light}}}body[data-theme=dark]{{{dark}}}"
        f"@media(prefers-color-scheme:dark){{body:not([data-theme=light]){{{dark}}}}}"
        + page_rules()
        + RULES
    )


RULES = """
article figure{margin:1.2rem 0}article figure svg,.symbol svg{display:block;max-width:100%;height:auto}
article figure.wide svg{width:100%}article figure.narrow svg{max-width:400px;width:100%}
article figure.drawing{overflow-x:auto}
article h1{font-size:2.1em}article h2{font-size:1.55em}article h3{font-size:1.2em}
article .highlight pre{font-size:.79rem}
article table.docutils{margin-left:0}
article code .option{white-space:nowrap}
article table.docutils:has(th:nth-child(5)){font-size:.875rem}
article table.docutils:has(th:nth-child(9)) :is(th,td){padding:.25rem .12rem}
#parameters td:last-child{min-width:9rem}
.symbol.alone{float:right;margin:0 0 1rem 1.5rem}
.block-list{display:grid;grid-template-columns:repeat(auto-fill,minmax(320px,1fr));gap:.4rem 1.6rem}
.block-entry{display:grid;grid-template-columns:112px 1fr;gap:.8rem;align-items:center}
.robot-list{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(220px,40%),1fr));gap:1.2rem}
.robot-entry img{display:block;width:100%;height:auto}
.robot-entry p{margin:.2rem 0;line-height:1.35;font-size:.9em}
.robot-entry p:empty{display:none}article figure.robot img{width:100%;max-width:400px;height:auto}
.block-entry p{margin:.2rem 0;line-height:1.35;font-size:.92em}
.block-entry .symbol{justify-self:center}
article td wbr{display:none}
@media(max-width:46em){article table.docutils:not(:has(th:nth-child(3))) td+td code{overflow-wrap:break-word}}
@media(max-width:46em){article table.docutils:not(:has(th:nth-child(3))) td+td wbr{display:inline}}
@media(max-width:46em){article h1{font-size:1.45em}article h2{font-size:1.3em}article h3{font-size:1.15em}}
@media(max-width:46em){article table.docutils:has(th:nth-child(5)){width:max-content;max-width:44rem}}
@media(max-width:46em){article table.docutils:has(th:nth-child(7)){width:max-content;max-width:72rem}}
@media(max-width:46em){article table.docutils:has(th:nth-child(5)) td code{overflow-wrap:normal!important}}
@media(max-width:46em){article figure.wide{overflow-x:auto}article figure.wide svg{min-width:560px}}
"""
