"""Joint positions of the pictures of the shipped robots."""

from __future__ import annotations

from armblocks.robot import Robot

_ELBOW_UP = (0.5, 0.4, 0.2, 0.0, 0.8, 0.0)
_FANUC = (0.5, 0.4, 0.1, 0.0, -0.9, 0.0)
_KUKA = (-0.5, -1.2, 1.35, 0.0, 1.0, 0.0)
_UR = (3.6, -1.3, 1.5, -1.8, -1.57, 0.0)
_SEVEN = (0.5, 0.5, 0.0, -1.5, 0.0, 1.2, 0.0)
_KUKA_PALLETISER = (-0.5, -1.5, 1.7, 0.0)
_ABB_PALLETISER = (0.5, 0.2, 0.2, 0.0)
_POSES: dict[str, tuple[float, ...]] = {
    "am120ib_10l": _FANUC,
    "baxter_left": (0.4, 0.2, 0.0, 1.1, 0.0, 0.7, 0.0),
    "baxter_right": (0.9, 0.2, 0.0, 1.1, 0.0, 0.7, 0.0),
    "cobra600": (0.5, 0.8, 0.1, 0.0),
    "crb15000": _ELBOW_UP,
    "crx10ia_l": _FANUC,
    "fr3": (0.5, 0.3, 0.0, -1.8, 0.0, 2.1, 0.0),
    "gen3": (0.5, 0.6, 3.14, -1.6, 0.0, -0.9, 0.0),
    "gen3_6dof": (0.5, 0.4, -1.2, 0.0, -0.6, 0.0),
    "gp25": _FANUC,
    "gp7": _FANUC,
    "hp20d_6": _FANUC,
    "hp6": _FANUC,
    "iiwa14": _SEVEN,
    "iiwa7": _SEVEN,
    "irb120": _ELBOW_UP,
    "irb1200": _ELBOW_UP,
    "irb140": _ELBOW_UP,
    "irb2400": _ELBOW_UP,
    "irb2600": _ELBOW_UP,
    "irb460": _ABB_PALLETISER,
    "irb4600": _ELBOW_UP,
    "irb660": _ABB_PALLETISER,
    "irb6640": _ELBOW_UP,
    "irb760": _ABB_PALLETISER,
    "jaco": (0.5, 2.6, 1.3, 4.2, 1.4, 0.0),
    "kr16_2": _KUKA,
    "kr100_2_pa": _KUKA_PALLETISER,
    "kr180": (0.5, 0.2, 0.3, 0.0),
    "kr180_2_pa": _KUKA_PALLETISER,
    "kr180_cell": (0.5, 0.2, 0.3, 0.0),
    "kr3_r540": _KUKA,
    "kr40_pa": _KUKA_PALLETISER,
    "kr5_arc": _KUKA,
    "kr5_scara_r350": (0.5, 0.8, 0.1, 0.0),
    "kr6_r900": _KUKA,
    "kr700_pa": _KUKA_PALLETISER,
    "lite6": (0.5, 0.4, 1.6, 0.0, 1.2, 0.0),
    "lrmate200id": _FANUC,
    "lwr4": (0.5, 0.5, 0.0, -1.5, 0.0, 1.2, 0.0),
    "m10ia": _FANUC,
    "m16ib_20": _FANUC,
    "m410ic_185": (0.5, 0.3, -0.2, 0.0),
    "m710ic_50": _FANUC,
    "mico": (0.5, 2.6, 1.3, 4.2, 1.4, 0.0),
    "nao_left_arm": (0.6, 0.3, -0.8, -1.0, 0.0),
    "nao_left_leg": (0.0, 0.0, -0.6, 1.1, -0.5, 0.0),
    "panda": (0.5, 0.3, 0.0, -1.8, 0.0, 2.1, 0.0),
    "phantomx": (0.5, -0.3, 0.9, 0.6),
    "planar3r": (0.4, 0.7, 0.6),
    "puma560": (0.5, 0.9, -2.6, 0.0, 0.6, 0.0),
    "puma560_akb": (0.5, -0.9, 2.6, 0.0, 0.6, 0.0),
    "r2000ic_165f": _FANUC,
    "rx160": (0.5, 0.3, 1.2, 0.0, 0.8, 0.0),
    "sawyer": (0.3, -0.6, 0.0, 1.2, 0.0, 0.8, 0.0),
    "sia20d": (0.5, 0.5, 0.0, -1.5, 0.0, -0.6, 0.0),
    "stanford": (0.0, 1.2, 0.8, 0.0, 0.5, 0.0),
    "twolink": (0.6, 0.7),
    "tx60": (0.5, 0.3, 1.2, 0.0, 0.8, 0.0),
    "tx90": (0.5, 0.3, 1.2, 0.0, 0.8, 0.0),
    "xarm5": (0.5, 0.3, -1.2, 0.9, 0.0),
    "xarm6": (0.5, 0.2, -1.2, 0.0, 0.9, 0.0),
    "xarm7": (0.5, 0.4, 0.0, 1.3, 0.0, 0.9, 0.0),
    **dict.fromkeys(
        ("ur10", "ur10e", "ur16e", "ur20", "ur3", "ur3e", "ur5", "ur5e"), _UR
    ),
}


def pose_of(name: str, robot: Robot) -> tuple[float, ...]:
    """Joint coordinates of the robot's picture, rad or m; neutral ones for robots that are not listed."""
    return _POSES.get(name, tuple(robot.neutral.tolist()))
