"""Views of an arm from Python: a widget in a notebook, a page in the browser elsewhere."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.face.arm import Arm
from armblocks.face.arm_pictures import Appearance
from armblocks.studio.view_content import ViewContent, arm_content, motion_content

Array = NDArray[np.float64]


def show_arm(arm: Arm, q: Array, look: Appearance, *, block: bool) -> Any:
    """Show a configuration with sliders in a notebook, or in the browser."""
    return _shown(arm_content(arm.robot, q), look, block)


def show_motion(arm: Arm, q: Array, time: Array, poses: Array, look: Appearance, *, block: bool) -> Any:
    """Play a motion in a notebook, or in the browser."""
    return _shown(motion_content(arm.robot, q, time, poses), look, block)


def in_notebook() -> bool:
    """Whether the call comes from a notebook that shows widgets: Jupyter, VS Code, Colab, marimo."""
    marimo = sys.modules.get("marimo")
    if marimo is not None and marimo.running_in_notebook():
        return True
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and getattr(shell, "kernel", None) is not None


def _shown(content: ViewContent, look: Appearance, block: bool) -> Any:
    if in_notebook():
        from armblocks.studio.notebook import HEIGHT, content_widget

        return content_widget(content, look.size[1] if look.size else HEIGHT)
    from armblocks.studio.view_server import open_page

    page = open_page(content, look.theme)
    if block:
        page.wait()
    return page
