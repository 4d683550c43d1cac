"""The rules that findings about CAD exports of Simscape Multibody refer to.

The codes ``simscape-joint`` and ``simscape-loop`` are in the messages of errors.
"""

from __future__ import annotations

from armblocks.formats.file_findings import Rule

JOINT_CODE = "simscape-joint"
"""The code of a joint, or of mates, whose motion is not one rotation, one translation or none."""
LOOP_CODE = "simscape-loop"
"""The code of a closed loop."""

FREE = Rule(
    code="simscape-free",
    allowed="parts that joints or mates connect with a grounded part",
    remedy="ground the part, or add the missing mate, in the CAD assembly",
)
FRAMES = Rule(
    code="simscape-frames",
    allowed="joints whose two frames agree in the assembled position, except for the motion of the joint",
    remedy="rebuild the assembly in the CAD program and export it again",
)
MASS = Rule(
    code="simscape-mass",
    allowed="a mass and an inertia for every part",
    remedy="read the XML file of the export, or assign a material in the CAD program",
)
UNITS = Rule(
    code="simscape-units",
    allowed="units of mass and length in the file",
    remedy="add the units; without them kg and m are used",
)
GEOMETRY = Rule(
    code="simscape-geometry",
    allowed="robots without geometry files",
    remedy="the arm is drawn from its joints; STEP files are not read",
)
MATE = Rule(
    code="simscape-mate",
    allowed="coincident, concentric, parallel, perpendicular, angle, distance and fixed mates",
    remedy="replace the mate by such mates, or by a joint",
)

SIMSCAPE_RULES = (FREE, FRAMES, MASS, UNITS, GEOMETRY, MATE)
"""All rules of this format."""
