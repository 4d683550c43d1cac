"""The rules that findings about URDF files refer to."""

from __future__ import annotations

from armblocks.formats.file_findings import Rule

MIMIC = Rule(
    code="urdf-mimic",
    allowed="<mimic> of another revolute, continuous or prismatic joint, with a multiplier other than 0",
    remedy="correct the name of the other joint, or remove <mimic>",
)
NO_LIMIT = Rule(
    code="urdf-limit-missing",
    allowed="a <limit> in revolute and prismatic joints",
    remedy="add <limit lower upper effort velocity>, or use a continuous joint",
)
LIMIT = Rule(
    code="urdf-limit",
    allowed="lower < upper, effort and velocity above zero",
    remedy="correct the limit, or omit the attribute where it is unknown",
)
AXIS = Rule(
    code="urdf-axis",
    allowed="an axis of length 1",
    remedy="divide the axis by its length",
)
ANGLE = Rule(
    code="urdf-angle",
    allowed="angles in rad",
    remedy="divide degrees by 57.29577951308232",
)
DAMPING = Rule(
    code="urdf-dynamics",
    allowed="damping and friction of zero or more",
    remedy="correct the sign",
)
TRANSMISSION = Rule(
    code="urdf-transmission",
    allowed="transmissions with one joint, one actuator and a reduction other than zero",
    remedy="describe the motor of each joint by a separate transmission",
)
UNKNOWN = Rule(
    code="urdf-unknown-element",
    allowed="the elements of URDF",
    remedy="correct the spelling, or remove the element",
)
MESH = Rule(
    code="urdf-mesh",
    allowed="STL, OBJ, COLLADA, GLB and MSH meshes that can be found",
    remedy="give the folder of the package with packages={…}, or convert the mesh to STL or OBJ",
)
SHAPE = Rule(
    code="urdf-shape",
    allowed="box, cylinder, sphere, capsule and mesh, with sizes above zero",
    remedy="correct the shape",
)

INERTIAL = Rule(
    code="urdf-inertial",
    allowed="<mass> and <inertia> in every <inertial>",
    remedy="add the missing element; a missing element is read as zero",
)
NAME = Rule(
    code="urdf-name",
    allowed="unique names of links and joints",
    remedy="rename or remove one of the elements",
)

URDF_RULES = (
    MIMIC,
    NO_LIMIT,
    LIMIT,
    AXIS,
    ANGLE,
    DAMPING,
    TRANSMISSION,
    UNKNOWN,
    MESH,
    SHAPE,
    INERTIAL,
    NAME,
)
"""All rules of this format."""
