"""The rules that findings about MJCF files refer to."""

from __future__ import annotations

from armblocks.formats.file_findings import Rule

STIFFNESS = Rule(
    code="mjcf-stiffness",
    allowed="springs at hinges and slides, linear in the displacement, and no surrounding medium",
    remedy="add the forces to the joint torques",
)
EQUALITY = Rule(
    code="mjcf-equality",
    allowed="connect and weld between bodies or sites, and joint with a linear polynomial",
    remedy="choose joint coordinates and torques that satisfy the constraint, or replace it",
)
TENDON = Rule(
    code="mjcf-tendon",
    allowed="actuators at joints",
    remedy="compute the joint torques of the tendons separately",
)
LIMIT = Rule(
    code="mjcf-limit",
    allowed="range limits in increasing order",
    remedy="correct the range, or omit it where it is unknown",
)
FRICTION = Rule(
    code="mjcf-friction",
    allowed="damping proportional to the speed, frictionloss and armature, all of zero or more",
    remedy="correct the number",
)
INERTIA = Rule(
    code="mjcf-inertia",
    allowed="bodies whose masses follow from <inertial> or from solid shapes and mesh files that can be read",
    remedy="add <inertial pos mass diaginertia>",
)
MESH = Rule(
    code="mjcf-mesh",
    allowed="mesh files that can be found and read",
    remedy="put the file at the place that <compiler meshdir> and <mesh file> name",
)
SHAPE = Rule(
    code="mjcf-shape",
    allowed="sphere, capsule, ellipsoid, cylinder, box and mesh, with sizes above zero",
    remedy="correct the shape",
)
UNREAD = Rule(
    code="mjcf-not-read",
    allowed="a tree of bodies, with all constraints and friction enabled",
    remedy="describe the part by bodies, or remove it where it is disabled",
)
NAME = Rule(
    code="mjcf-name",
    allowed="unique names of bodies",
    remedy="rename one of the bodies",
)

KEYFRAME = Rule(
    code="mjcf-keyframe",
    allowed="key frames with one number in qpos for each coordinate of the joints that are read",
    remedy="record the configuration again, by arm.with_configuration(name, q)",
)

MJCF_RULES = (*(STIFFNESS, EQUALITY, TENDON, LIMIT, FRICTION, INERTIA, MESH, SHAPE, UNREAD, NAME, KEYFRAME),)
"""All rules of this format."""
