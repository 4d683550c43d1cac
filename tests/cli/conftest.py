"""Fixtures of the command-line tests: calls in this process and in a separate process."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import pytest
from typer.main import get_command
from typer.testing import CliRunner, Result

from armblocks.cli.main import app

cached_command = cache(get_command)
"""Built once: otherwise Typer's runner reads the signatures of all commands in each call."""


@pytest.fixture
def invoke(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Return a function that calls the command line in this process, from an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("typer.testing._get_command", cached_command)

    def call(*arguments: str, columns: int = 80) -> Result:
        return CliRunner().invoke(app, list(arguments), env={"COLUMNS": str(columns), "ARMBLOCKS_DEBUG": ""})

    return call


@pytest.fixture
def refusal(invoke: Callable[..., Result]) -> Callable[..., str]:
    """Return a function that calls the command line with bad input and returns the message."""

    def call(*arguments: str) -> str:
        result = invoke(*arguments)
        assert result.exit_code == 2, result.output
        assert "Traceback" not in result.output
        assert "error" in result.stderr.lower()
        return " ".join(result.stderr.split())

    return call


@pytest.fixture
def spawn(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Return a function that calls the command line in a separate process, from an empty folder."""

    def call(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "armblocks", *arguments],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            encoding="utf-8",
            env={**os.environ, "COLUMNS": "80", "PYTHONIOENCODING": "utf-8"},
            timeout=120,
        )

    return call


@pytest.fixture
def write_diagram(tmp_path: Path) -> Callable[..., str]:
    """Return a function that writes a diagram of ``{"name": ("Type", {parameters})}`` and connections."""

    def write(
        blocks: Mapping[str, tuple[str, Mapping[str, object]]], *connections: str, **settings: object
    ) -> str:
        document = {
            "format": 1,
            "name": "handmade",
            "blocks": {name: {"type": kind, "parameters": values} for name, (kind, values) in blocks.items()},
            "connections": sorted(connections),
            "settings": settings,
        }
        path = tmp_path / "handmade.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        return str(path)

    return write
