"""Lazily exporting packages provide the same names to the interpreter and to type checkers."""

import ast
import importlib
import inspect
from pathlib import Path

import pytest

PACKAGES = (
    "armblocks",
    "armblocks.drawing",
    "armblocks.equations",
    "armblocks.formats",
    "armblocks.rendering",
    "armblocks.report",
    "armblocks.simulation",
)


def homes_for_type_checkers(package: str) -> dict[str, str]:
    """Name and module of every import under ``if TYPE_CHECKING``."""
    tree = ast.parse(Path(importlib.import_module(package).__file__ or "").read_text())
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    return {
        alias.name: f"{node.module}.{alias.name}" if node.module == package else node.module or ""
        for node in imports
        for alias in node.names
    }


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_comes_from_the_module_that_type_checkers_see(package: str) -> None:
    module = importlib.import_module(package)
    homes = homes_for_type_checkers(package)
    assert sorted(homes) == sorted(module.__all__)
    for name, home in homes.items():
        value = getattr(module, name)
        if home == f"{package}.{name}":
            assert value is importlib.import_module(home)
        else:
            assert inspect.unwrap(value) is inspect.unwrap(getattr(importlib.import_module(home), name))


@pytest.mark.parametrize("package", PACKAGES)
def test_no_exported_name_equals_the_name_of_its_module(package: str) -> None:
    # Importing the module would replace the exported object by the module.
    module = importlib.import_module(package)
    homes = homes_for_type_checkers(package)
    folder = Path(module.__file__ or "").parent
    modules = {path.stem for path in folder.iterdir()}
    assert {name for name, home in homes.items() if name in modules} <= {
        name for name, home in homes.items() if home == f"{package}.{name}"
    }


@pytest.mark.parametrize("package", PACKAGES)
def test_an_unknown_name_raises_an_attribute_error(package: str) -> None:
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'fkin'"):
        importlib.import_module(package).fkin  # noqa: B018 - the access is the test
