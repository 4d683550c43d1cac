"""The distribution of the test files to the test processes."""

from __future__ import annotations

from typing import Any

from xdist.scheduler.loadfile import LoadFileScheduling

BROWSER_TESTS = "tests/studio/journeys/"
"""The folder with the tests that use a browser."""


class BrowserFilesBeside(LoadFileScheduling):
    """Whole files in sequence, but every third process begins with the files without a browser.

    A browser test waits for its page during half of its time. If all processes ran browser tests at first,
    processor time would remain unused; two with a browser and one without use two cores.
    """

    def _assign_work_unit(self, node: Any) -> None:
        with_browser = self.nodes.index(node) % 3 != 2
        preferred = next((file for file in self.workqueue if (BROWSER_TESTS in file) == with_browser), None)
        if preferred is not None:
            self.workqueue.move_to_end(preferred, last=False)
        super()._assign_work_unit(node)
