"""``import armblocks`` and the help of the command line import no slow libraries."""

import json
import subprocess
import sys

# Further modules that are imported only after the front end of the studio is served.
LOADED_LATER = {"casadi", "pydantic"} | {
    f"armblocks.{package}" for package in ("blocks", "diagram", "drawing", "rendering", "report")
}
SLOW = {"scipy", "matplotlib", "pandas", "pyarrow", "llvmlite", "starlette", "numpy"}


def loaded_by(statement: str) -> set[str]:
    """Names of the modules that a new process has imported after the statement."""
    script = f"{statement}\nimport sys, json\nprint(json.dumps(sorted(sys.modules)))"
    completed = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(json.loads(completed.stdout))


def test_import_armblocks_imports_no_slow_library() -> None:
    assert loaded_by("import armblocks") & (SLOW | {"typer", "rich"}) == set()


def test_the_command_line_starts_without_slow_libraries() -> None:
    assert loaded_by("import armblocks.cli.main") & SLOW == set()


def test_data_files_are_written_without_pandas() -> None:
    write = (
        "import numpy as np, pathlib, tempfile; from armblocks.simulation.export import open_log\n"
        "for suffix in ('csv', 'parquet'):\n"
        "    with tempfile.TemporaryDirectory() as folder:\n"
        "        log = open_log(pathlib.Path(folder) / f'log.{suffix}', ['x'])\n"
        "        log.append(np.zeros(3), np.ones((1, 3)))\n"
        "        log.finish({})"
    )
    assert loaded_by(write) & (SLOW - {"numpy"}) == {"pyarrow"}


def test_the_page_of_the_studio_is_served_before_slow_imports() -> None:
    loaded = loaded_by("import armblocks.studio.server.launch")
    assert "starlette" in loaded
    assert loaded & (SLOW - {"starlette"} | LOADED_LATER) == set()


def test_robot_scripts_are_evaluated_without_casadi() -> None:
    read = "from armblocks.formats import read_script; read_script(b'x = sin(1)', 'x.m')"
    assert loaded_by(read) & (SLOW - {"numpy"} | {"casadi"}) == set()
