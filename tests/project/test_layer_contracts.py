"""The import contracts of pyproject.toml are kept, and each of them detects a violation."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

VIOLATIONS = {
    "A layer imports only lower layers": ("robot", "import armblocks.face", "armblocks.face"),
    "In the studio, a layer imports only lower layers": (
        "studio.sheet",
        "import armblocks.studio.runs.pace",
        "armblocks.studio.runs.pace",
    ),
    "Numerics does not import modelling": ("simulation", "import armblocks.blocks", "armblocks.blocks"),
    "Modelling does not import numerics": ("formats", "import armblocks.compiler", "armblocks.compiler"),
    "Only compiler imports llvmlite": ("simulation", "import llvmlite.binding", "llvmlite"),
    "In numerics, only compiler.from_casadi imports casadi": (
        "compiler",
        "from casadi import SX",
        "casadi",
    ),
    "Only cli imports typer and rich": ("report", "from rich.table import Table", "rich"),
    "Only pictures imports matplotlib": ("face", "import matplotlib.pyplot", "matplotlib"),
    "Only pictures imports the encoders of videos": ("face", "import PIL.Image", "PIL"),
    "Only algebra imports sympy": ("face", "import sympy", "sympy"),
    "Only export, sweeps.files and analysis import pandas, pyarrow and scipy": (
        "simulation",
        "def late():\n    from scipy.io import savemat",
        "scipy",
    ),
}
"""One violation of each contract: package, inserted line, and the imported module."""


def check_contracts(folder: Path) -> tuple[dict[str, bool], dict[str, str]]:
    """Run import-linter in ``folder``; return which contracts are kept, and the output for broken ones."""
    script = (
        "import sys; sys.path.insert(0, 'src'); "
        "from importlinter.cli import lint_imports; sys.exit(lint_imports())"
    )
    completed = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, encoding="utf-8"
    )
    text = re.sub(r"\x1b\[[0-9;]*m", "", completed.stdout)
    results = re.findall(r"^(.+?) (KEPT|BROKEN)", text, re.MULTILINE)
    assert results, completed.stdout + completed.stderr
    sections = re.split(r"^(.+)\n-{4,}$", text.partition("Broken contracts\n")[2], flags=re.MULTILINE)
    return {name: verdict == "KEPT" for name, verdict in results}, dict(zip(sections[1::2], sections[2::2]))


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the package and its contracts, without bytecode."""
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    shutil.copytree(
        ROOT / "src" / "armblocks",
        tmp_path / "src" / "armblocks",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    return tmp_path


def test_every_contract_is_kept(copy: Path) -> None:
    verdicts, _ = check_contracts(copy)
    assert sorted(verdicts) == sorted(VIOLATIONS)
    assert all(verdicts.values()), verdicts


def test_every_contract_detects_its_violation(copy: Path) -> None:
    """All violations are present at the same time: the output for each contract names its violation."""
    for package, line, _ in VIOLATIONS.values():
        with copy.joinpath("src", "armblocks", *package.split("."), "__init__.py").open(
            "a", encoding="utf-8"
        ) as stream:
            stream.write(f"\n{line}\n")
    verdicts, message = check_contracts(copy)
    assert not any(verdicts.values()), verdicts
    for contract, (package, _, imported) in VIOLATIONS.items():
        assert f"armblocks.{package} -> {imported} (l." in message[contract], contract
