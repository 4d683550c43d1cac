"""Blocks that display or store their inputs; they have views and no outputs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from armblocks.blocks.elementwise import numbered_ports
from armblocks.diagram import (
    Block,
    FileSettings,
    Port,
    SpectrumSettings,
    View,
    ViewKind,
    WorkedExample,
    driver,
    parameter,
)
from armblocks.diagram.signs import FaceSign, Words, graph
from armblocks.errors import InputError

FILE_SUFFIXES = ("csv", "npz", "mat", "parquet")
QUANTITIES = ("amplitude", "power density")
WINDOWS = ("hann", "hamming", "blackman", "flat top", "rectangular")


@dataclass(frozen=True, kw_only=True)
class Scope(Block):
    """A scope: traces of all inputs over time."""

    title: ClassVar[str] = "Scope"
    card_size: ClassVar[tuple[float, float]] = (72.0, 60.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Two signals with the same unit share one panel.",
        parameters={"inputs": 2},
        inputs={"u1": driver("SineWave"), "u2": driver("PulseGenerator")},
    )

    inputs: int = parameter(1, minimum=1, doc="number of inputs")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "signal to plot")

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.TRACES, signals=tuple(port.name for port in self.input_ports())),)


@dataclass(frozen=True, kw_only=True)
class XYGraph(Block):
    """An x-y plot of two signals."""

    title: ClassVar[str] = "XY Graph"
    card_size: ClassVar[tuple[float, float]] = (72.0, 60.0)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A Lissajous figure: two sines of different frequencies.",
        inputs={"x": driver("SineWave", frequency=2.0), "y": driver("SineWave", frequency=3.0)},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("x", "signal of the horizontal axis"), Port("y", "signal of the vertical axis"))

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.PATH, signals=("x", "y")),)


@dataclass(frozen=True, kw_only=True)
class Display(Block):
    """A numeric display of one or several signals."""

    title: ClassVar[str] = "Display"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The value at the end of the run.",
        inputs={"u": driver("Ramp", slope=0.5)},
    )

    inputs: int = parameter(1, minimum=1, doc="number of inputs")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "signal to show")

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.VALUE, signals=tuple(port.name for port in self.input_ports())),)


@dataclass(frozen=True, kw_only=True)
class ToWorkspace(Block):
    """Stores the signal under a name in the exported data."""

    title: ClassVar[str] = "To Workspace"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The signal is stored under the given name; a scope shows it here.",
        inputs={"u": driver("SineWave")},
        shown=("u",),
    )

    variable: str = parameter("simout", doc="the name of the variable")

    def face_sign(self) -> FaceSign:
        return Words(self.variable)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to store"),)

    def views(self) -> tuple[View, ...]:
        return (View(kind=ViewKind.DATA, signals=("u",), labels=(self.variable,)),)


@dataclass(frozen=True, kw_only=True)
class ToFile(Block):
    """Stores the signal in a separate file: CSV, NPZ, MAT or Parquet, by the file name extension.

    - The run itself writes no file. ``write_report`` (and thus ``armblocks run``) writes the file into the
      report's folder; ``write_files`` writes it into a given folder. The path must be inside that folder.
    - The file has one row for every ``decimation``-th recorded sample time, beginning with the first. If
      there are more than ``limit`` rows, the file has only the last rows.
    """

    title: ClassVar[str] = "To File"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The signal is written to a file beside the report; a scope shows it here.",
        parameters={"file": "wave.csv", "variable": "wave"},
        inputs={"u": driver("SineWave")},
        shown=("u",),
    )

    file: str = parameter("simout.csv", doc="path of the file, relative to the folder of the report")
    variable: str = parameter("simout", doc="the name of the variable in the file")
    decimation: int = parameter(1, minimum=1, doc="every n-th recorded sample time is stored")
    limit: int = parameter(
        1_000_000, minimum=1, maximum=10_000_000, doc="maximum number of rows; the last rows are stored"
    )

    def face_sign(self) -> FaceSign:
        return Words(self.file.rpartition("/")[2])

    def check(self) -> None:
        parts = self.file.split("/")
        is_valid = all(part.strip(". ") and not set(part) & set('\\:*?"<>|') for part in parts)
        if not is_valid or not self.file.isprintable() or parts[-1].rpartition(".")[2] not in FILE_SUFFIXES:
            raise InputError(
                f"the file is '{self.file}'"[:120],
                where="ToFile.file",
                allowed="a path inside a folder that ends in "
                + ", ".join("." + suffix for suffix in FILE_SUFFIXES),
                fix="omit '..' and a leading '/'; the path is relative to the folder of the report",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to store"),)

    def views(self) -> tuple[View, ...]:
        settings = FileSettings(file=self.file, decimation=self.decimation, limit=self.limit)
        return (View(kind=ViewKind.FILE, signals=("u",), labels=(self.variable,), subject=settings),)


@dataclass(frozen=True, kw_only=True)
class Spectrum(Block):
    """The spectrum of a signal: amplitudes, or power spectral density by Welch's method.

    - ``amplitude``: the amplitude of a sine at each frequency, A = 2 |X| / sum(w).
    - ``power density``: one-sided, 2 |X|^2 / (fs sum(w^2)); its integral over the frequency is the mean
      square of the signal.

    X is the discrete Fourier transform of evenly spaced samples times the window w, and fs the sampling rate
    in Hz. Several half-overlapping segments are averaged (Welch, IEEE Trans. Audio Electroacoustics 15,
    1967). Signals are interpolated linearly between the recorded sample times. There is no anti-aliasing
    filter: choose a sufficiently small ``sample_time``.
    """

    title: ClassVar[str] = "Spectrum"
    sign: ClassVar[FaceSign] = graph(
        (0, 0), (0.22, 0.1), (0.28, 1), (0.34, 0.1), (0.6, 0.06), (0.66, 0.5), (0.72, 0.06), (1, 0)
    )
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Two sines of 0.5 and 2 Hz with the amplitudes 1 and 0.1.",
        parameters={"decibels": False, "sample_rate": 10.0},
        inputs={
            "u": driver("Sum").by(
                u1=driver("SineWave", frequency=math.pi),
                u2=driver("SineWave", amplitude=0.1, frequency=4 * math.pi),
            )
        },
        shown=("u",),
    )

    inputs: int = parameter(1, minimum=1, doc="number of inputs")
    quantity: str = parameter("amplitude", choices=QUANTITIES, doc="quantity to show")
    window: str = parameter("hann", choices=WINDOWS, doc="window function of a segment")
    averages: int = parameter(1, minimum=1, doc="number of half-overlapping segments to average")
    sample_rate: float = parameter(
        0.0, minimum=0.0, tunable=False, unit="Hz", doc="sampling rate; 0 uses the recorded sample times"
    )
    begin: float = parameter(0.0, tunable=False, unit="s", doc="start of the evaluated time range")
    remove_mean: bool = parameter(True, doc="whether the mean of each segment is subtracted")
    decibels: bool = parameter(True, doc="whether the vertical axis is in decibels")
    logarithmic: bool = parameter(False, doc="whether the frequency axis is logarithmic")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "signal to analyse")

    def views(self) -> tuple[View, ...]:
        settings = SpectrumSettings(
            quantity=self.quantity,
            window=self.window,
            averages=self.averages,
            sample_rate=self.sample_rate,
            begin=self.begin,
            remove_mean=self.remove_mean,
            decibels=self.decibels,
            logarithmic=self.logarithmic,
        )
        signals = tuple(port.name for port in self.input_ports())
        return (View(kind=ViewKind.SPECTRUM, signals=signals, subject=settings),)


@dataclass(frozen=True, kw_only=True)
class Terminator(Block):
    """Terminates an unused signal."""

    title: ClassVar[str] = "Terminator"
    card_size: ClassVar[tuple[float, float]] = (34.0, 34.0)
    sign: ClassVar[FaceSign] = Words("⊣")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The signal is not used; a scope shows it here.",
        inputs={"u": driver("SineWave")},
        shown=("u",),
    )

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "unused signal"),)
