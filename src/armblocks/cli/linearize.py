"""``armblocks linearize``: prints the linear system of a diagram and draws its figures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from armblocks.cli.assignments import chosen_parameters
from armblocks.cli.completion import ModelName, ParameterSetName
from armblocks.cli.terminal import STRONG, results_console, table
from armblocks.errors import InputError, counted

if TYPE_CHECKING:
    from armblocks import LinearSystem, OperatingPoint

MAX_POLES = 12
"""Maximum number of listed poles."""


def linearize(
    model: ModelName,
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="SIGNAL", help="An input: signal or parameter; may be repeated."),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option("--output", metavar="SIGNAL", help="An output signal; may be repeated."),
    ] = None,
    opened: Annotated[
        list[str] | None,
        typer.Option(
            "--open", metavar="SIGNAL", help="A signal at which the loop is opened; may be repeated."
        ),
    ] = None,
    at: Annotated[float, typer.Option(help="Time of the run at which to linearize, s.")] = 0.0,
    delay_order: Annotated[
        int | None,
        typer.Option(help="States per dead time (order of the Padé approximation).", show_default=False),
    ] = None,
    trimmed: Annotated[
        bool, typer.Option("--trim", help="Trim, starting at the --at time, and linearize at the result.")
    ] = False,
    free: Annotated[
        list[str] | None,
        typer.Option("--free", metavar="BLOCK.PARAMETER", help="With --trim: a free parameter."),
    ] = None,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="BLOCK.PARAMETER=VALUE", help="Change a parameter; may be repeated."),
    ] = None,
    parameter_set: ParameterSetName = None,
    save: Annotated[Path | None, typer.Option(help="Also write a .json, .npz or .mat file.")] = None,
    report: Annotated[Path | None, typer.Option(help="Folder for all figures.")] = None,
    hertz: Annotated[bool, typer.Option("--hertz", help="Frequencies in Hz, not in rad/s.")] = False,
) -> None:
    """Print the exact linear system of a diagram: matrices, poles, zeros, margins.

    If one signal is the input, the output and the opening, its open loop is printed with inverted sign:
    as the loop transfer function L of 1 + L.
    """
    import armblocks as ab

    if free and not trimmed:
        raise InputError(
            "--free is given without --trim",
            allowed="--free with --trim only",
            fix="add --trim",
            where="armblocks linearize",
        )
    diagram = ab.load_diagram(model)
    parameters = chosen_parameters(diagram, parameter_set, assignments)
    point: float | OperatingPoint = at
    if trimmed:
        point = ab.trim(diagram, free=free or (), at=at, parameters=parameters).point
    system: LinearSystem = ab.linearize(
        diagram,
        inputs or (),
        outputs or (),
        at=point,
        open=opened or (),
        delay_order=delay_order,
        parameters=parameters,
    )
    loop = bool(opened) and opened == inputs == outputs and system.is_siso
    shown_system = -system if loop else system
    console = results_console()
    print_system(shown_system, console, loop=loop, hertz=hertz)
    if save is not None:
        shown_system.save(save)
        console.print(f"saved: {save}", soft_wrap=True)
    if report is not None:
        from armblocks.report import write_linear_report

        files = write_linear_report(report, shown_system, loop=loop, hertz=hertz)
        console.print(f"report: {report}, {counted(len(files), 'file')}", soft_wrap=True)


def print_system(system: LinearSystem, console: Console, *, loop: bool, hertz: bool) -> None:
    """Print the heading, matrices, poles, zeros and, for a single channel, gain, bandwidth and margins."""
    from armblocks.analysis.shown_values import shown_dcgain, shown_zeros
    from armblocks.analysis.text import complex_number, heading, matrices, matrix_lines

    console.print(heading(system), style=STRONG)
    for letter, matrix, rows, columns in matrices(system):
        console.print()
        console.print(letter, style=STRONG)
        console.print("\n".join(matrix_lines(matrix, rows, columns)), soft_wrap=True)
    if system.order:
        _print_poles(system, console, hertz=hertz)
    if system.inputs and system.outputs:
        zeros = ", ".join(complex_number(zero) for zero in shown_zeros(system).tolist()[:MAX_POLES])
        console.print(f"zeros: {zeros or 'none'}", soft_wrap=True)
    if not system.is_siso:
        return
    gain = float(shown_dcgain(system)[0, 0])
    console.print(f"steady-state gain: {gain:.6g}")
    if loop:
        _print_margins(system, console, hertz=hertz)
    elif system.is_stable and math.isfinite(gain) and gain:
        width = system.bandwidth()
        if math.isfinite(width):
            console.print(f"bandwidth (3 dB): {_frequency(width, hertz)}")


def _print_poles(system: LinearSystem, console: Console, *, hertz: bool) -> None:
    from armblocks.analysis.shown_values import shown_modes
    from armblocks.analysis.text import complex_number

    unit = "Hz" if hertz else "rad/s"
    rows = table(
        ("pole", "left"), (f"frequency, {unit}", "right"), ("damping", "right"), ("time constant, s", "right")
    )
    modes = shown_modes(system)
    for mode in modes[:MAX_POLES]:
        rows.add_row(
            complex_number(mode.pole),
            f"{mode.frequency / (2 * math.pi if hertz else 1.0):.5g}",
            f"{mode.damping:.4g}",
            "-" if math.isinf(mode.time_constant) else f"{mode.time_constant:.4g}",
        )
    console.print()
    console.print(rows)
    if len(modes) > MAX_POLES:
        console.print(f"and {counted(len(modes) - MAX_POLES, 'faster mode')}")
    console.print()


def _print_margins(system: LinearSystem, console: Console, *, hertz: bool) -> None:
    from armblocks.analysis.margins import shown_margins

    margins = shown_margins(system)
    rows = table(("margin of 1 + L", "left"), ("", "right"), ("at", "right"))
    if math.isfinite(margins.gain):
        text = f"{margins.gain_decibels:.4g} dB (factor {margins.gain:.4g})"
        rows.add_row("gain", text, _frequency(margins.gain_frequency, hertz))
    else:
        rows.add_row("gain", "infinite", "")
    if math.isfinite(margins.phase):
        rows.add_row("phase", f"{margins.phase:.4g} deg", _frequency(margins.phase_frequency, hertz))
        rows.add_row("delay", f"{margins.delay:.4g} s", _frequency(margins.delay_frequency, hertz))
    else:
        rows.add_row("phase", "infinite", "")
    rows.add_row("distance from -1", f"{margins.modulus:.4g}", _frequency(margins.modulus_frequency, hertz))
    console.print()
    console.print(rows)
    console.print("closed loop: " + ("stable" if margins.stable else "unstable"))


def _frequency(value: float, hertz: bool) -> str:
    if math.isinf(value):
        return "infinite frequency"
    return f"{value / (2 * math.pi):.5g} Hz" if hertz else f"{value:.5g} rad/s"
