"""The main workflow of the studio in Firefox; without Firefox the test summary reports the skipped test."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import pytest
from firefox_bidi import Firefox, firefox_path

from conftest import Studio


@pytest.mark.skipif(firefox_path() is None, reason="Firefox is not installed (apt-get install firefox-esr)")
def test_the_model_of_the_paper_is_run_and_edited_in_firefox(tmp_path: Path) -> None:
    with ExitStack() as stack:
        studio = Studio(tmp_path)
        stack.callback(studio.stop)
        firefox = Firefox(firefox_path() or "")
        stack.callback(firefox.close)
        firefox.open(studio.link)
        firefox.wait("document.querySelectorAll('.react-flow__node').length === 15")
        firefox.wait("document.querySelector('.robot')")
        firefox.press("Control", "Enter")
        firefox.wait("/done/i.test(document.querySelector('.run-state')?.textContent)")
        firefox.wait("document.querySelectorAll('.chart canvas').length === 7")
        firefox.value("document.querySelector('.react-flow__node').focus()")
        firefox.press("Delete")
        firefox.wait("document.querySelectorAll('.react-flow__node').length === 14")
        firefox.press("Control", "z")
        firefox.wait("document.querySelectorAll('.react-flow__node').length === 15")
        assert not firefox.errors
