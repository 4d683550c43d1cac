"""The third-party notices of the packages in the front end of the studio.

The bundler lists packages with code, styles or fonts in the bundle (``bundled_packages.ts``). Their licence
texts come from their folders in ``node_modules``, or from ``frontend/licences`` for packages without a
licence file.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

FRONTEND = Path(__file__).resolve().parent
LICENCE_FOLDER = FRONTEND / "licences"
"""Licence texts of packages without a licence file, by package name with ``-`` for ``/``."""
NOTICES_FILE = "THIRD-PARTY-NOTICES.txt"
PACKAGE_LIST = "bundled-packages.json"
LICENCE_FILES = ("licence", "license", "copying", "notice", "unlicense")
HEADING = "The front end of the armblocks studio contains the packages below, or parts of them.\n"


@dataclass(frozen=True)
class Package:
    """A package in the bundle, with the text of its licence."""

    name: str
    version: str
    licence: str
    text: str


def write_notices(web: Path) -> None:
    """Write the notices into the folder of the built front end, and remove the lists of the bundler."""
    lists = [web / PACKAGE_LIST, web / "notebook" / PACKAGE_LIST]
    folders = {folder for path in lists for folder in json.loads(path.read_text(encoding="utf-8"))}
    (web / NOTICES_FILE).write_text(notices(map(package, sorted(folders))), encoding="utf-8")
    for path in lists:
        path.unlink()


def notices(packages: Iterable[Package]) -> str:
    """The file of notices: each package once, after a horizontal rule."""
    unique = {(package.name, package.version): package for package in packages}
    rule = "-" * 80
    parts = [
        f"{rule}\n{name} {version} ({package.licence})\n{rule}\n\n{package.text.strip()}\n"
        for (name, version), package in sorted(unique.items())
    ]
    return "\n".join([HEADING, *parts])


def package(folder: str, root: Path = FRONTEND) -> Package:
    """The package of a folder of ``node_modules``; exits with a message if its licence text is missing."""
    manifest = json.loads((root / folder / "package.json").read_text(encoding="utf-8"))
    name = manifest["name"]
    stored_text = LICENCE_FOLDER / f"{name.replace('/', '-')}.txt"
    licence_files = sorted(
        path for path in (root / folder).iterdir() if path.name.lower().startswith(LICENCE_FILES)
    )
    texts = [path.read_text(encoding="utf-8") for path in licence_files if path.is_file()] or [
        path.read_text(encoding="utf-8") for path in (stored_text,) if path.is_file()
    ]
    if not texts:
        raise SystemExit(
            f"the package {name} is part of the front end of the studio and has no licence text:\n"
            f"copy the text from its repository to {stored_text}"
        )
    return Package(name, manifest["version"], manifest.get("license", "see below"), "\n\n".join(texts))
