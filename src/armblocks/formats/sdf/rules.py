"""The rules that findings about SDF files refer to."""

from __future__ import annotations

from armblocks.formats.file_findings import Rule

AXIS = Rule(
    code="sdf-axis",
    allowed="an <axis> with an <xyz> of length 1",
    remedy="add the axis, or divide it by its length",
)
LIMIT = Rule(
    code="sdf-limit",
    allowed="lower < upper, effort and velocity above zero, or negative where there is no limit",
    remedy="correct the limit, or remove the element where it is unknown",
)
DAMPING = Rule(
    code="sdf-dynamics",
    allowed="damping, friction and rotor inertia of zero or more",
    remedy="correct the sign",
)
SPRING = Rule(
    code="sdf-spring",
    allowed="springs with a stiffness of zero or more",
    remedy="correct the sign",
)
COUPLING = Rule(
    code="sdf-coupling",
    allowed="<mimic> of a joint with one axis, and gearboxes between revolute joints of one body",
    remedy="correct the names of joints and bodies, or compute the coupled coordinates separately",
)
CLOSURE = Rule(
    code="sdf-closure",
    allowed="joints that close a loop without limits, friction and springs",
    remedy="close the loop at another joint: move this joint up in the file",
)
NO_INERTIA = Rule(
    code="sdf-inertia-default",
    allowed="<inertial> with <mass> and <inertia> in every link that moves",
    remedy="add the mass and the inertia; without them SDF has 1 kg and 1 kg m2",
)
AUTO_INERTIA = Rule(
    code="sdf-inertia-auto",
    allowed="inertias given as numbers",
    remedy="write the mass and the inertia of the shapes",
)
GRAVITY = Rule(
    code="sdf-gravity",
    allowed="links with gravity",
    remedy="add the torques that balance the weight of the link",
)
FREE_LINK = Rule(
    code="sdf-free-link",
    allowed="links that joints connect with each other or with the world",
    remedy="add the missing joint, or write the unconnected parts as separate models",
)
MODEL = Rule(
    code="sdf-model",
    allowed="models that can be read",
    remedy="correct the model, or load the file of the model itself",
)
FRAME = Rule(
    code="sdf-frame",
    allowed="names of frames in the attribute relative_to, or in the attribute frame before SDF 1.7",
    remedy="remove the attribute, or correct the name",
)
ANGLE = Rule(
    code="sdf-angle",
    allowed='angles in rad, or degrees="true"',
    remedy='add degrees="true" to the <pose>',
)
UNKNOWN = Rule(
    code="sdf-unknown-element",
    allowed="the elements of SDF",
    remedy="correct the spelling, or remove the element",
)
MESH = Rule(
    code="sdf-mesh",
    allowed="STL, OBJ, COLLADA, GLB and MSH meshes that can be found",
    remedy="give the folder of the model or package with packages={…}, or convert the mesh to STL or OBJ",
)
SHAPE = Rule(
    code="sdf-shape",
    allowed="box, cylinder, sphere, capsule and mesh, with sizes above zero",
    remedy="correct the shape",
)

SDF_RULES = (
    AXIS,
    LIMIT,
    DAMPING,
    SPRING,
    COUPLING,
    CLOSURE,
    NO_INERTIA,
    AUTO_INERTIA,
    GRAVITY,
    FREE_LINK,
    MODEL,
    FRAME,
    ANGLE,
    UNKNOWN,
    MESH,
    SHAPE,
)
"""All rules of this format."""
