"""The contracts of pyproject.toml hold, and each of them would notice a violation."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

VIOLATIONS = {
    "A line imports only lines below it": ("robot/__init__.py", "import armblocks.face"),
    "Numerics never meet modelling": ("simulation/__init__.py", "import armblocks.blocks"),
    "Modelling never meets numerics": ("formats/__init__.py", "import armblocks.compiler"),
    "llvmlite has one door: compiler": ("simulation/__init__.py", "import llvmlite.binding"),
    "On the numerics side casadi has one door: compiler.from_casadi": (
        "compiler/__init__.py",
        "from casadi import SX",
    ),
    "typer and rich have one door: cli": ("report/__init__.py", "from rich.table import Table"),
    "matplotlib has one door: report": ("face/__init__.py", "import matplotlib.pyplot"),
    "pandas, pyarrow and scipy have their doors: export, analysis": (
        "simulation/__init__.py",
        "def late():\n    from scipy.io import savemat",
    ),
}
"""One violation a contract: the module of armblocks that gets the line, and the line."""


def judge(folder: Path) -> dict[str, bool]:
    """Run import-linter over ``folder/src``: by contract, whether it is kept."""
    script = (
        "import sys; sys.path.insert(0, 'src'); "
        "from importlinter.cli import lint_imports; sys.exit(lint_imports())"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, encoding="utf-8"
    )
    found = re.findall(r"^(.+?) (KEPT|BROKEN)", re.sub(r"\x1b\[[0-9;]*m", "", done.stdout), re.MULTILINE)
    assert found, done.stdout + done.stderr
    return {name: verdict == "KEPT" for name, verdict in found}


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
    verdicts = judge(copy)
    assert sorted(verdicts) == sorted(VIOLATIONS)
    assert all(verdicts.values()), verdicts


@pytest.mark.parametrize("contract", VIOLATIONS)
def test_a_contract_notices_its_violation(contract: str, copy: Path) -> None:
    module, line = VIOLATIONS[contract]
    with (copy / "src" / "armblocks" / module).open("a", encoding="utf-8") as stream:
        stream.write(f"\n{line}\n")
    assert judge(copy)[contract] is False
