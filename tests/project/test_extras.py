"""The core works without the optional libraries; the error of a feature that needs one names its extra."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyarrow import csv as arrow_csv
from pyarrow import table

from armblocks.extras import LIBRARIES, from_extra
from armblocks.simulation.csv_rows import csv_rows

ROOT = Path(__file__).resolve().parents[2]
CORE_DEPENDENCY = "pydantic"
"""Also a dependency of the core, through typer."""
INDIRECT = {"anywidget": {"traitlets"}}
"""Indirect dependencies."""
IMPORT_NAMES = {"pillow": "PIL", "imageio-ffmpeg": "imageio_ffmpeg"}
"""Import names of libraries that differ from their names in the package index."""

WITHOUT_EXTRAS = """
import importlib, json, pkgutil, sys, warnings
from pathlib import Path

absent = set(json.loads(sys.argv[1]))

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in absent:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Absent())
import armblocks as ab
from armblocks.cli.main import app

for module in pkgutil.walk_packages(ab.__path__, "armblocks."):
    if not module.name.startswith(("armblocks.studio", "armblocks.__main__")):
        importlib.import_module(module.name)
import armblocks.studio.notebook

warnings.simplefilter("ignore")
app(["run", "kr180model", "--stop-time", "0.1", "--out", "report"], standalone_mode=False)
app(["trim", "puma560_computed_torque"], standalone_mode=False)
model = ab.load_diagram("puma560_computed_torque")
ab.draw_diagram(model, "model.svg")
result = ab.simulate(model, stop_time=0.1)
for name in ("signals.csv", "signals.npz"):
    result.save(name)
    ab.load_table(name)
Path("arm.xacro").write_bytes(b"<robot/>")
for name in ("a.mat", "a.parquet"):
    Path(name).write_bytes(b"")
linear = ab.linearize(model)

messages = {}
for name, call in {
    "data frame": result.to_dataframe,
    "save parquet": lambda: result.save("x.parquet"),
    "save mat": lambda: result.save("x.mat"),
    "load parquet": lambda: ab.load_table("a.parquet"),
    "load mat": lambda: ab.load_table("a.mat"),
    "log": lambda: ab.simulate(model, stop_time=0.1, log="x.parquet"),
    "report data": lambda: ab.write_report("other", model, result, data=("mat",)),
    "report figures": lambda: ab.write_report("other", model, result, formats=("png",)),
    "png": lambda: ab.draw_diagram(model, "x.png"),
    "pdf": lambda: ab.draw_diagram(model, "x.pdf"),
    "poles": linear.poles,
    "widget": lambda: ab.robot_widget(ab.load_robot("puma560")),
    "xacro": lambda: ab.load_robot("arm.xacro"),
    "sympy": lambda: ab.load_robot("puma560").symbolic.fkine().to_sympy(),
    "gif": lambda: ab.load_robot("puma560").animate([[0.0] * 6] * 2, 0.1, save="x.gif"),
    "mp4": lambda: ab.load_robot("puma560").animate([[0.0] * 6] * 2, 0.1, save="x.mp4"),
}.items():
    try:
        messages[name] = repr(call())
    except ab.errors.MissingLibraryError as error:
        messages[name] = str(error)
    except BaseException as error:
        messages[name] = repr(error)
Path("messages.json").write_text(json.dumps(messages))
sys.exit(app(["studio", "--no-browser"], standalone_mode=False))
"""


def test_the_core_runs_without_the_extras_and_names_missing_libraries(tmp_path: Path) -> None:
    absent = sorted({name for names in LIBRARIES.values() for name in names} - {CORE_DEPENDENCY} | {"PIL"})
    completed = subprocess.run(
        [sys.executable, "-c", WITHOUT_EXTRAS, json.dumps(absent)],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    assert completed.returncode == 2, completed.stderr
    assert "the library 'starlette' is not installed; it is needed for the studio" in completed.stderr
    assert 'pip install "armblocks[studio]"' in completed.stderr
    assert (
        'To write PNG figures and Parquet as well: pip install "armblocks[figures,data]"' in completed.stdout
    )
    written = {path.name for path in (tmp_path / "report").iterdir()}
    assert written == {"report.html", "diagram.svg", "data.csv", "figures"}
    assert {path.suffix for path in (tmp_path / "report" / "figures").iterdir()} == {".svg"}
    assert not (tmp_path / "other").exists()
    message = json.loads((tmp_path / "messages.json").read_text(encoding="utf-8"))
    expected = {
        "data frame": ("pandas", "data", "data frames"),
        "save parquet": ("pyarrow", "data", "Parquet files"),
        "save mat": ("scipy", "data", "MAT files"),
        "load parquet": ("pyarrow", "data", "Parquet files"),
        "load mat": ("scipy", "data", "MAT files"),
        "log": ("pyarrow", "data", "Parquet files"),
        "report data": ("scipy", "data", "MAT files"),
        "report figures": ("matplotlib", "figures", "PNG figures"),
        "png": ("matplotlib", "figures", "PNG figures"),
        "pdf": ("matplotlib", "figures", "PDF drawings"),
        "poles": ("scipy", "analysis", "poles of a linear system"),
        "widget": ("anywidget", "notebook", "widgets in notebooks"),
        "xacro": ("xacro", "xacro", "xacro files"),
        "sympy": ("sympy", "symbolic", "expressions of SymPy"),
        "gif": ("PIL", "film", "GIF videos"),
        "mp4": ("imageio_ffmpeg", "film", "MP4 videos"),
    }
    assert message.keys() == expected.keys()
    for name, (library, extra, use) in expected.items():
        assert f"the library '{library}' is not installed; it is needed for {use}" in message[name]
        assert message[name].endswith(
            f'Allowed: everything else works without it. Fix: pip install "armblocks[{extra}]".'
        )


def test_messages_and_pyproject_agree_on_the_libraries_of_the_extras() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    named = {name: {entry.partition(">")[0] for entry in extras[name]} for name in LIBRARIES}
    for name, libraries in LIBRARIES.items():
        installed = {IMPORT_NAMES.get(entry, entry) for entry in named[name] - {"armblocks[figures]"}}
        installed |= {other for library in installed for other in INDIRECT.get(library, set())}
        assert installed == set(libraries), name
    assert extras["all"] == [f"armblocks[{','.join(sorted(LIBRARIES))}]"]
    assert "armblocks[all,docs]" in extras["test"]


def test_a_library_that_fails_to_import_is_not_reported_as_missing() -> None:
    with pytest.raises(ModuleNotFoundError, match="another"), from_extra("data", "data frames"):
        raise ModuleNotFoundError("No module named 'another'", name="another.part")


@settings(deadline=None)  # the first call loads a library
@given(st.lists(st.lists(st.floats(width=64), min_size=3, max_size=3), min_size=1, max_size=5))
def test_csv_rows_equal_the_output_of_pyarrow(rows: list[list[float]]) -> None:
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    check_rows(columns)


def test_csv_rows_at_the_limits_between_fixed_and_scientific_notation() -> None:
    powers = np.array(
        [sign * digits * 10.0**k for k in range(-9, 19) for digits in (1.0, 1.5, 1 / 3) for sign in (1, -1)]
    )
    near = np.concatenate([powers, np.nextafter(powers, 0.0), np.nextafter(powers, np.inf)])
    check_rows([near, near[::-1].copy()])
    assert csv_rows([np.empty(0), np.empty(0)]) == ""


def check_rows(columns: list[np.ndarray]) -> None:
    """Compare the text of both writers."""
    import io

    written = io.BytesIO()
    named = {str(number): column for number, column in enumerate(columns)}
    arrow_csv.write_csv(table(named), written, arrow_csv.WriteOptions(include_header=False))
    assert csv_rows(columns).encode() == written.getvalue()
