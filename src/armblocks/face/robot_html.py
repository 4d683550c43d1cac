"""The notebook view of a robot: picture and table in self-contained HTML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from armblocks.errors import counted
from armblocks.robot import Link, Robot
from armblocks.robot.dh_table import coordinate_text

STYLE = """
.ab-robot{font:13px/1.45 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif;color:inherit}
.ab-robot{display:flex;flex-wrap:wrap;gap:8px 24px;align-items:flex-start;max-width:1120px}
.ab-robot h3{font-size:15px;margin:0 0 2px;font-weight:600}
.ab-robot p{margin:0 0 8px;opacity:.78}
.ab-robot table{border-collapse:collapse;font-variant-numeric:tabular-nums}
.ab-robot th,.ab-robot td{text-align:right;padding:2px 8px;border-bottom:1px solid rgba(128,128,128,.3)}
.ab-robot th:first-child,.ab-robot td:first-child{text-align:left}
"""

MAX_SHOWN = 20
"""Maximum number of named configurations in a view."""
HEADINGS = ("link", "joint", "α °", "a m", "θ °", "d m", "range", "speed", "mass kg", "G")


def robot_html(robot: Robot, picture_svg: str) -> str:
    """A picture, and a table of the links: D-H row, limits in degrees or m, mass in kg, gear ratio."""
    about = " · ".join(text for text in (robot.manufacturer, robot.comment) if text)
    rows = "".join(_row("td", _cells(link)) for link in robot.links)
    return (
        f'<div class="ab-robot"><style>{STYLE}</style>{picture_svg}<div>'
        f"<h3>{escape(robot.name)}</h3><p>{counted(len(robot.joints), 'joint')} {robot.joint_letters}"
        f"{' · ' + escape(about) if about else ''}</p>"
        f"<table>{_row('th', HEADINGS)}{rows}</table>{_configurations(robot)}</div></div>"
    )


def _configurations(robot: Robot) -> str:
    """A table of the named configurations, in degrees or m; at most ``MAX_SHOWN`` of them."""
    entries = robot.configurations.entries
    if not entries:
        return ""
    heads = ("configuration", *(entry.name for entry in robot.positions))
    units = [entry.unit for entry in robot.positions]
    rows = "".join(_row("td", (name, *map(coordinate_text, q, units))) for name, q in entries[:MAX_SHOWN])
    more = len(entries) - MAX_SHOWN
    note = f"<p>and {counted(more, 'other configuration')}</p>" if more > 0 else ""
    return f'<table style="margin-top:12px">{_row("th", heads)}{rows}</table>{note}'


def _row(kind: str, cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{kind}>{escape(cell)}</{kind}>" for cell in cells) + "</tr>"


def _cells(link: Link) -> list[str]:
    spans: list[str] = []
    speeds: list[str] = []
    for coordinate, limits in zip(link.joint.speeds, link.joint.coordinate_limits):
        scale, unit = (180 / np.pi, "°") if coordinate.unit == "rad" else (1.0, " m")
        ends = () if limits.position is None else limits.position
        spans.append(" … ".join(f"{end * scale:g}" for end in ends) + unit if ends else "")
        speeds.append("" if limits.speed is None else f"{limits.speed * scale:g}{unit}/s")
    span, speed = ("; ".join(filter(None, texts)) for texts in (spans, speeds))
    gear = "" if link.motor is None else f"{link.motor.gear_ratio:g}"
    return [link.name, link.joint.letter, *_dh_cells(link), span, speed, f"{link.mass:g}", gear]


def _dh_cells(link: Link) -> list[str]:
    """The D-H row, with q as the joint variable; empty if the link has no row."""
    row = link.dh
    if row is None:
        return [""] * 4
    theta = f"{np.degrees(row.theta):g}" if row.sigma else "q"
    d = "q" if row.sigma else f"{row.d:g}"
    return [f"{np.degrees(row.alpha):g}", f"{row.a:g}", theta, d]
