"""Build hooks: the front end of the studio and the documentation, which wheels of armblocks contain.

An editable installation builds neither: ``armblocks studio`` and ``armblocks docs`` build them at the first
use. The hooks build nothing if the result is up to date or the sources are missing. A source distribution
contains the built front end and the sources of the documentation. ``ARMBLOCKS_SKIP_WEB=1`` omits the front
end, ``ARMBLOCKS_SKIP_DOCS=1`` the documentation; everything else works without them.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

ROOT = Path(__file__).resolve().parent
FRONTEND = ROOT / "frontend"
DOCS = ROOT / "docs"
DOCS_IN_WHEEL = "armblocks/shipped/docs"
sys.path[:0] = [str(FRONTEND), str(DOCS)]


class FrontEndAndDocsHook(BuildHookInterface):
    """Build hook of hatchling for wheels, including editable ones, and for source distributions."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Build dependencies: Node.js as a wheel if the system has none, Sphinx, and those of armblocks."""
        # The method has no argument for editable builds; pip calls the build back end with this command.
        if "get_requires_for_build_editable" in sys.argv:
            return []
        requirements: list[str] = []
        if _front_end_needed():
            from node import NODE_WHEEL, system_npm

            requirements += [] if system_npm() else [NODE_WHEEL]
        if self.target_name == "wheel" and _docs_needed():
            # The pages are generated from the imported code and from runs of the blocks' examples.
            requirements += [
                *self.metadata.core.dependencies,
                *self.metadata.core.optional_dependencies["docs"],
            ]
        return requirements

    def initialize(self, version: str, build_data: dict[str, dict[str, str]]) -> None:
        """Build the missing or outdated files, and add the documentation to the wheel."""
        if version == "editable":
            return
        if _front_end_needed():
            from build_page import build

            build()
        if self.target_name == "wheel":
            if _docs_needed():
                import build_site

                build_site.build()
            if _docs_wanted():
                build_data["force_include"]["docs/_build/html"] = DOCS_IN_WHEEL


class PackageReadme(MetadataHookInterface):
    """Metadata hook of hatchling: it sets the description for a package index."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, object]) -> None:
        """Set the readme."""
        text = (ROOT / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": for_package_index(text)}


def for_package_index(readme: str) -> str:
    """Return the README without pictures and without links to files, which a package index does not have.

    The text of a removed link remains. Links to web sites are unchanged.
    """
    without_pictures = re.sub(
        r"<picture>.*?</picture>\n+|!\[[^\]]*\]\([^)]*\)\n+", "", readme, flags=re.DOTALL
    )
    return re.sub(r"\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", without_pictures)


def _front_end_needed() -> bool:
    """Whether the front end of the studio must be built."""
    if os.environ.get("ARMBLOCKS_SKIP_WEB") == "1" or not FRONTEND.is_dir():
        return False
    from build_page import is_outdated

    return is_outdated()


def _docs_wanted() -> bool:
    """Whether the wheel contains the documentation."""
    return os.environ.get("ARMBLOCKS_SKIP_DOCS") != "1" and DOCS.is_dir()


def _docs_needed() -> bool:
    """Whether the documentation must be built."""
    if not _docs_wanted():
        return False
    import build_site

    return build_site.needed()


if __name__ == "__main__":
    from build_page import main

    main()
