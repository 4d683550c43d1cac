"""Version, citation, change log and the workflow of a public host agree."""

import re
import runpy
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_version_is_the_same_everywhere() -> None:
    version = PROJECT["version"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    log = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    sections = re.findall(r"^## \[([^\]]+)\](?: - (\d{4}-\d\d-\d\d))?$", log, re.MULTILINE)
    assert sections[0] == ("Unreleased", "")
    assert sections[1] == (version, str(citation["date-released"]))
    assert citation["version"] == version
    installation = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    assert f"dist/armblocks-{version}-py3-none-any.whl" in installation


def test_the_public_host_runs_the_checks_of_the_project_on_three_systems() -> None:
    text = (ROOT / ".github" / "workflows" / "checks.yml").read_text(encoding="utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    assert jobs["test"]["steps"][-1]["run"] == ".ci/run"
    systems = {name.partition("-")[0] for name in jobs["test"]["strategy"]["matrix"]["system"]}
    assert systems == {"ubuntu", "macos", "windows"}
    oldest = PROJECT["requires-python"].removeprefix(">=")
    pythons = jobs["install"]["strategy"]["matrix"]["python"]
    assert pythons[0] == oldest
    for python in pythons:
        assert f"Programming Language :: Python :: {python}" in PROJECT["classifiers"]


def test_caches_of_checks_do_not_make_the_documentation_outdated(tmp_path: Path) -> None:
    folder = tmp_path / "docs"
    folder.mkdir()
    script = folder / "build_site.py"
    script.write_bytes((ROOT / "docs" / "build_site.py").read_bytes())
    site = runpy.run_path(str(script))
    before = site["digest"]()
    for name in (".ruff_cache", "__pycache__"):
        (folder / name).mkdir()
        (folder / name / "entry").touch()
    assert site["digest"]() == before
    (folder / "page.md").touch()
    assert site["digest"]() != before
