"""``armblocks run``: simulates a diagram, prints a summary, and writes a report."""

from __future__ import annotations

import warnings
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armblocks.cli.assignments import chosen_parameters
from armblocks.cli.completion import ModelName, ParameterSetName
from armblocks.cli.progress import FrameProgress, RunProgress
from armblocks.cli.terminal import messages_console, results_console
from armblocks.errors import FormatError, LimitWarning, SimulationError

if TYPE_CHECKING:
    from armblocks import Diagram, SimulationResult
    from armblocks.report.writing import ReportFiles


class DataFormat(StrEnum):
    """Optional data formats, in addition to CSV and Parquet."""

    NPZ = "npz"
    MAT = "mat"


FilmFile = Annotated[
    Path | None,
    typer.Option(help="Write a video of the arms to this .mp4 or .gif file; needs the extra film."),
]
StateFile = Annotated[
    Path | None, typer.Option(help="Save the final state in this .npz file, for --from-state.")
]
ReportFolder = Annotated[Path | None, typer.Option(help="Folder of the report.", show_default="MODEL-report")]
RecordJumps = Annotated[
    bool | None,
    typer.Option(
        "--jumps/--no-jumps", help="Record both sides of every jump of a signal.", show_default="the model's"
    ),
]


def run(
    model: ModelName,
    stop_time: Annotated[
        float | None, typer.Option(help="Simulated time, s.", show_default="the model's")
    ] = None,
    solver: Annotated[
        str | None,
        typer.Option(
            help="auto, or a solver of 'armblocks list solvers', such as rk4; rodas5p for stiff systems."
        ),
    ] = None,
    step: Annotated[float | None, typer.Option(help="Step of a fixed-step solver, s.")] = None,
    sample_time: Annotated[float | None, typer.Option(help="Interval of the recorded samples, s.")] = None,
    rtol: Annotated[float | None, typer.Option(help="Relative tolerance of an adaptive solver.")] = None,
    atol: Annotated[float | None, typer.Option(help="Absolute tolerance of an adaptive solver.")] = None,
    jumps: RecordJumps = None,
    from_state: Annotated[
        Path | None, typer.Option(help="Continue from the saved state of an earlier run.")
    ] = None,
    save_state: StateFile = None,
    log: Annotated[
        Path | None,
        typer.Option(help="Write all recorded samples to this .parquet or .csv file during the run."),
    ] = None,
    log_signals: Annotated[
        str | None,
        typer.Option(help="Signals in the file of --log, separated by commas.", show_default="all"),
    ] = None,
    film: FilmFile = None,
    out: ReportFolder = None,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="BLOCK.PARAMETER=VALUE", help="Change a parameter; may be repeated."),
    ] = None,
    parameter_set: ParameterSetName = None,
    formats: Annotated[
        list[DataFormat] | None, typer.Option("--format", help="An additional data format; may be repeated.")
    ] = None,
    figures: Annotated[
        bool, typer.Option("--figures/--no-figures", help="Also write the figures as files.")
    ] = True,
    trust: Annotated[
        bool, typer.Option("--trust", help="Run the Python files that the diagram names.")
    ] = False,
    open_report: Annotated[bool, typer.Option("--open", help="Open the report in the browser.")] = False,
) -> None:
    """Simulate a diagram and write a report: figures, numbers, data."""
    import armblocks as ab
    from armblocks.cli.summary import print_displays, print_files, print_motions, print_run

    diagram = ab.load_diagram(model, trust=trust)
    parameters = chosen_parameters(diagram, parameter_set, assignments)
    settings = _given_settings(stop_time=stop_time, solver=solver, step=step, sample_time=sample_time)
    settings |= _given_settings(rtol=rtol, atol=atol, record_jumps=jumps)
    _check_files(diagram, formats or [], film)
    folder = out or Path(f"{diagram.name}-report")
    new_folders = [path for path in (folder, *folder.parents) if not path.exists()]
    _check_writable(folder)
    signals = [name.strip() for name in log_signals.split(",")] if log_signals else []
    settings.update(parameters=parameters, initial_state=from_state, log=log, log_signals=signals)
    with _empty_folders_removed(new_folders):
        result, failure = _simulate(diagram, settings)
    files = _report(folder, diagram, result, figures, formats or [])
    if save_state is not None and result.final_state is not None:
        result.final_state.save(save_state)
    console = results_console()
    print_run(result, console)
    print_displays(diagram, result, console)
    print_motions(diagram, result, console)
    print_files(files, console)
    if film is not None:
        console.print(f"video: {_film(film, diagram, result)}", highlight=False)
    if result.log is not None:
        console.print(f"all {result.log.rows} rows: {result.log.path}", highlight=False)
    if open_report:
        typer.launch(str(files.page))
    if failure is not None:
        raise failure
    if not result.run.complete:
        raise KeyboardInterrupt


def _given_settings(**settings: Any) -> dict[str, Any]:
    """The settings given on the command line. The others have the values of the model."""
    return {name: value for name, value in settings.items() if value is not None}


def _simulate(diagram: Diagram, settings: dict[str, Any]) -> tuple[SimulationResult, SimulationError | None]:
    """The result and no error; for a failed run the partial result and its error."""
    import armblocks as ab

    with RunProgress(diagram.name, messages_console()) as progress:
        try:
            return ab.simulate(diagram, progress=progress, **settings), None
        except SimulationError as error:
            if not isinstance(error.partial, ab.SimulationResult):
                raise
            return error.partial, error


def _report(
    folder: Path, diagram: Diagram, result: SimulationResult, figures: bool, formats: list[DataFormat]
) -> ReportFiles:
    import armblocks as ab
    from armblocks.report.writing import usable_data_formats

    with warnings.catch_warnings():
        # The summary lists the exceeded limits.
        warnings.simplefilter("ignore", LimitWarning)
        return ab.write_report(
            folder,
            diagram,
            result,
            formats=None if figures else (),
            data=(*usable_data_formats(), *(extra.value for extra in formats)),
        )


def _film(path: Path, diagram: Diagram, result: SimulationResult) -> Path:
    import armblocks as ab

    with FrameProgress(path.name, messages_console()) as progress:
        return ab.write_film(path, diagram, result, progress=progress)


def _check_files(diagram: Diagram, formats: list[DataFormat], film: Path | None) -> None:
    """Check before the run that the files can be written."""
    if film is not None:
        from armblocks.pictures.film import check_film

        check_film(film, 1, (2, 2))
    from armblocks.report.sink_files import REPORT_DATA, sink_files
    from armblocks.simulation.export import check_format

    sink_files(diagram, REPORT_DATA)
    for extra in formats:
        check_format(Path(f"data.{extra.value}"))


def _check_writable(folder: Path) -> None:
    """Create the folder if absent. Raises ``FormatError`` before the run if the folder cannot be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".armblocks-probe"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise FormatError(
            f"the folder cannot be written ({error.strerror or error})",
            where=str(folder),
            fix="give another folder with --out",
        ) from error


@contextmanager
def _empty_folders_removed(new_folders: Sequence[Path]) -> Generator[None]:
    """After an error in the ``with`` block, remove the folders that were created for the run, if empty."""
    try:
        yield
    except BaseException:
        with suppress(OSError):
            for folder in new_folders:
                folder.rmdir()
        raise
