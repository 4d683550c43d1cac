"""Write the files of the shipped palletising arms from the lengths and ranges of their sources.

``python3 scripts/palletisers.py`` writes ``robots/*/robot.json`` of all arms in ``ARMS``. The linkages and
the masses are those of ``armblocks.robot.palletiser``; a test compares the files with this table.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import floor, log10, pi, radians
from pathlib import Path
from typing import Literal

import numpy as np

from armblocks.files import write_atomically
from armblocks.formats.canonical_json import canonical_bytes
from armblocks.formats.robot_json import is_one_line, robot_to_json
from armblocks.robot import JointLimits, Link, Robot
from armblocks.robot.palletiser import LEVER, TRIANGLE, AxisConvention, Masses, palletiser

ROBOTS = Path(__file__).resolve().parents[1] / "robots"
PACKAGE = "robotkinematicscatalogue 1.1.2 (Python Package Index), {}"
Range = tuple[float, float] | None
KUKA_AXES = (
    AxisConvention(sign=-1.0),
    AxisConvention(zero=pi / 2),
    AxisConvention(zero=-pi / 2),
    AxisConvention(sign=-1.0),
)
KUKA_NOTE = (
    "Joints A1, A2, A3 and A6 are turret, lower_arm, upper_arm and flange. A1 rotates about the downward "
    "and A6 about the upward vertical, the lower arm is stretched forward at A2 = 0, and A3 is "
    "relative to the lower arm, as in the source."
)
ABB_NOTE = (
    "Joints 1, 2, 3 and 6 are turret, lower_arm, drive_lever and flange. Axis 2 is measured from the "
    "vertical, positive forward, and axis 3 from the horizontal, positive down, independent of axis 2, "
    "as in the source."
)
FANUC_NOTE = (
    "Joints J1, J2, J3 and J4 are turret, lower_arm, drive_lever and flange. J2 is measured from the "
    "vertical, positive forward, and J3 from the horizontal, positive up, independent of J2; this "
    "convention gives the heights of the data sheet. The data sheet gives the widths of the ranges of "
    "J2 and J3, but not their zeros, so these ranges are omitted. The signs of J1 and J4 are a choice of "
    "armblocks."
)


@dataclass(frozen=True, kw_only=True)
class Arm:
    """The data of one arm: lengths in mm, angles in degrees.

    ``lengths``: height and offset of axis 2, lower arm, upper arm, wrist to flange forward and down.
    ``payload`` kg: for the estimate of the masses; ``published_payload``: whether a source states it.
    """

    name: str
    manufacturer: str
    lengths: tuple[float, float, float, float, float, float]
    angle: Literal["absolute", "relative"]
    axes: tuple[AxisConvention, ...]
    ranges: tuple[Range, Range, Range, Range]
    speeds: tuple[float | None, ...] = (None,) * 4
    payload: float
    payload_note: str
    published_payload: bool = True
    reach: float | None = None
    sources: tuple[str, ...]
    checked: str = ""
    licence: str = "AGPL (program); only facts are used"
    note: str

    @property
    def robot(self) -> Robot:
        """The arm with its linkages; masses and inertias of its bodies have two significant digits."""
        height, offset, lower, upper, forward, drop = (length / 1000 for length in self.lengths)
        limits = [
            JointLimits(
                position=None if limit is None else (radians(limit[0]), radians(limit[1])),
                speed=None if speed is None else radians(speed),
            )
            for limit, speed in zip(self.ranges, self.speeds, strict=True)
        ]
        robot = palletiser(
            self.name,
            shoulder_height=height,
            shoulder_offset=offset,
            lower_arm=lower,
            upper_arm=upper,
            wrist_offset=forward,
            flange_drop=drop,
            upper_arm_angle=self.angle,
            axes=self.axes,
            limits=limits,
            masses=Masses.estimated(self.payload, lower, upper),
            manufacturer=self.manufacturer,
        )
        return replace(robot, links=tuple(_with_two_digits(link) for link in robot.links))

    @property
    def notes(self) -> str:
        """The conventions, and the estimated quantities."""
        return (
            "Palletiser with four driven axes. A parallelogram linkage with a lever at the turret moves the "
            "upper arm, and further linkages keep the flange level. The rods and levers are bodies of the "
            f"model. {self.note} The positions of the pins of the linkages are not published. The assumed "
            f"length of the lever is {LEVER:g} of the upper arm, and the assumed distance of the level rods "
            f"from the arm axes is {TRIANGLE:g} of the upper arm. {self.payload_note} Masses are estimated, "
            "not measured: the masses of a KUKA KR 180 are scaled in proportion to payload and length "
            "(armblocks.robot.palletiser.Masses) and rounded to two digits. The links are beams of square "
            "section. Real values may differ by a factor of two. The counterbalance spring is not modelled. "
            "The model has no friction and no motor data."
        )

    @property
    def document(self) -> bytes:
        """The text of ``robot.json``."""
        facts: dict[str, object] = {
            "licence": self.licence,
            "masses": "estimated",
            "sources": list(self.sources),
            **({"payload": self.payload} if self.published_payload else {}),
            **({"reach": self.reach} if self.reach is not None else {}),
            **({"checked": self.checked} if self.checked else {}),
        }
        document = {**robot_to_json(self.robot), "facts": facts, "notes": self.notes}
        return canonical_bytes(document, one_line=is_one_line)


MODEL_NAME = "The payload follows from the model's name."
ASSUMED = "The masses are scaled with a payload of {} kg, which is assumed from the name of the variant."
ARMS = {
    "kr40_pa": Arm(
        name="KR 40 PA",
        manufacturer="KUKA",
        lengths=(620, 220, 850, 850, 200, 190),
        angle="relative",
        axes=KUKA_AXES,
        ranges=((-155, 155), (-120, -15), (15, 145), (-350, 350)),
        payload=40,
        payload_note=MODEL_NAME,
        sources=(PACKAGE.format("KUKA_KR_40_PA"),),
        note=KUKA_NOTE,
    ),
    "kr100_2_pa": Arm(
        name="KR 100-2 PA",
        manufacturer="KUKA",
        lengths=(750, 350, 1250, 1350, 250, 260),
        angle="relative",
        axes=KUKA_AXES,
        ranges=((-185, 185), (-129, 0), (-19, 161), (-350, 350)),
        payload=100,
        payload_note=MODEL_NAME,
        sources=(PACKAGE.format("KUKA_KR_100_2_PA"),),
        note=KUKA_NOTE,
    ),
    "kr180_2_pa": Arm(
        name="KR 180-2 PA",
        manufacturer="KUKA",
        lengths=(670, 350, 1250, 1350, 250, 180),
        angle="relative",
        axes=KUKA_AXES,
        ranges=((-185, 185), (-140, 0), (-19, 161), (-350, 350)),
        payload=180,
        payload_note=MODEL_NAME,
        sources=(PACKAGE.format("KUKA_KR_180_2_PA"),),
        note=KUKA_NOTE,
    ),
    "kr700_pa": Arm(
        name="KR 700 PA",
        manufacturer="KUKA",
        lengths=(900, 420, 1300, 1300, 300, 300),
        angle="relative",
        axes=KUKA_AXES,
        ranges=((-185, 185), (-120, 10), (-10, 150), (-350, 350)),
        payload=700,
        payload_note=MODEL_NAME,
        sources=(PACKAGE.format("KUKA_KR_700_PA"),),
        note=KUKA_NOTE,
    ),
    "irb460": Arm(
        name="IRB 460",
        manufacturer="ABB",
        lengths=(745, 260, 945, 1025, 225, 251.5),
        angle="absolute",
        axes=(AxisConvention(),) * 4,
        ranges=((-165, 165), (-40, 85), (-20, 120), (-300, 300)),
        payload=110,
        payload_note=ASSUMED.format(110),
        published_payload=False,
        sources=(PACKAGE.format("ABB_IRB460"),),
        note=ABB_NOTE,
    ),
    "irb660": Arm(
        name="IRB 660-180",
        manufacturer="ABB",
        lengths=(800, 300, 1280, 1350, 260, 247),
        angle="absolute",
        axes=(AxisConvention(),) * 4,
        ranges=((-180, 180), (-42, 85), (-20, 120), (-300, 300)),
        payload=180,
        payload_note="Payload, reach and ranges are those of the data sheet, lengths those of the package.",
        reach=3.15,
        sources=(PACKAGE.format("ABB_IRB660_180"), "ABB, data sheet PR10284EN_D: payload, reach, ranges"),
        note=ABB_NOTE,
    ),
    "irb760": Arm(
        name="IRB 760",
        manufacturer="ABB",
        lengths=(814.5, 300, 1280, 1350, 290, 269),
        angle="absolute",
        axes=(AxisConvention(),) * 4,
        ranges=((-180, 180), (-42, 82), (-20, 120), (-300, 300)),
        payload=450,
        payload_note=ASSUMED.format(450),
        published_payload=False,
        sources=(PACKAGE.format("ABB_IRB760"),),
        note=ABB_NOTE,
    ),
    "m410ic_185": Arm(
        name="M-410iC/185",
        manufacturer="FANUC",
        lengths=(1110, 390, 1220, 1300, 255, 159),
        angle="absolute",
        axes=(AxisConvention(), AxisConvention(), AxisConvention(sign=-1.0), AxisConvention()),
        ranges=((-180, 180), None, None, (-360, 360)),
        speeds=(140, 140, 140, 305),
        payload=185,
        payload_note="Payload, reach and speeds are those of the data sheet.",
        reach=3.143,
        sources=(
            "FANUC America, data sheet M-410iC/185: lengths, payload, reach, speeds, widths of the ranges "
            "(360, 144, 136, 720 deg)",
        ),
        checked="envelope of the data sheet",
        licence="only facts are used; no file is copied",
        note=FANUC_NOTE,
    ),
}


def _with_two_digits(link: Link) -> Link:
    inertia = np.array([[_rounded(entry) for entry in row] for row in link.inertia])
    return replace(link, mass=_rounded(link.mass), inertia=inertia)


def _rounded(value: float) -> float:
    return round(value, 1 - floor(log10(abs(value)))) if value else 0.0


if __name__ == "__main__":
    for folder, arm in ARMS.items():
        (ROBOTS / folder).mkdir(exist_ok=True)
        write_atomically(ROBOTS / folder / "robot.json", arm.document)
