"""Python functions in files of trusted diagrams: the only place that runs the code of a file."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from armblocks.errors import FormatError


def load_function(reference: str, folder: Path | None) -> Callable[..., object]:
    """The function ``file.py:name``. **Runs the file.**

    The path is relative to ``folder``. Raises ``FormatError`` where there is no such file or function, or the
    file's code fails.
    """
    path, _, name = reference.rpartition(":")
    file = Path(path) if folder is None else folder / path
    if not path.endswith(".py") or not name.isidentifier() or not file.is_file():
        raise FormatError(
            f"'{reference}' is not a function of a file",
            allowed="file.py:name, relative to the diagram",
            where=f"function '{reference[:80]}'",
            fix="write the file's path from the diagram's folder, a colon, and the function's name",
        )
    spec = spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise FormatError(
            f"the code of {path} fails: {type(error).__name__}: {error}"[:300],
            where=str(file),
            fix="run the file with Python, and correct the reported error",
        ) from error
    found = vars(module).get(name)
    if not callable(found):
        raise FormatError(
            f"{path} has no function named '{name}'",
            fix="correct the name",
            where=str(file),
            allowed="a function at the top level of the file",
        )
    return found
