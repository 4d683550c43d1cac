"""Random URDF texts, and an oracle that computes kinematics and dynamics from the text alone.

The oracle parses with ``xml.etree``, works in world axes, and obtains joint torques from Jacobians (Kane's
equations): ``tau_j = sum_i Jv_ij' m_i (a_i - g) + Jw_ij' (I_i alpha_i + w_i x I_i w_i)``. It shares no code
with the package.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

Array = np.ndarray
KINDS = ("revolute", "continuous", "prismatic", "fixed")
GRAVITY = np.array([0.0, 0.0, -9.81])


def numbers(values: Array | list[float]) -> str:
    """Numbers as text that is read back exactly."""
    return " ".join(repr(float(value)) for value in values)


def random_urdf(seed: int, links: int = 9) -> str:
    """A tree with every kind of joint, in an order of elements that is not that of the tree."""
    random = np.random.default_rng(seed)

    def origin() -> str:
        return f'<origin xyz="{numbers(random.normal(size=3))}" rpy="{numbers(random.uniform(-3, 3, 3))}"/>'

    parts: list[str] = []
    for k in range(links):
        a = random.normal(size=(3, 3))
        moment = a @ a.T + np.eye(3)
        entries = zip(("ixx", "iyy", "izz", "ixy", "iyz", "ixz"), (0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2))
        moments = " ".join(f'{name}="{float(moment[i, j])!r}"' for name, i, j in entries)
        inertial = (
            f'<inertial>{origin()}<mass value="{random.uniform(0.5, 3)}"/><inertia {moments}/></inertial>'
        )
        parts.append(f'<link name="l{k}">{inertial if random.random() < 0.9 else ""}</link>')
        if k == 0:
            continue
        kind = KINDS[int(random.integers(4))] if k > 2 else KINDS[2 * (k - 1)]
        details = f'<axis xyz="{numbers(random.normal(size=3))}"/>' if random.random() < 0.9 else ""
        details += '<limit lower="-5" upper="5" effort="100" velocity="10"/>'
        if random.random() < 0.5:
            details += f'<dynamics damping="{random.uniform(0, 2)}" friction="{random.uniform(0, 2)}"/>'
        parts.append(
            f'<joint name="j{k}" type="{kind}"><parent link="l{random.integers(k)}"/><child link="l{k}"/>'
            f"{origin() if random.random() < 0.9 else ''}{details}</joint>"
        )
        if kind != "fixed" and random.random() < 0.5:
            rotor = f"<rotorInertia>{random.uniform(0, 1e-3)}</rotorInertia>"
            gear = f"<mechanicalReduction>{random.uniform(-100, -1)}</mechanicalReduction>"
            motor = f'<actuator name="m{k}">{gear}{rotor}</actuator>'
            parts.append(f'<transmission name="t{k}"><joint name="j{k}"/>{motor}</transmission>')
    random.shuffle(parts)
    return f'<?xml version="1.0"?>\n<robot name="random{seed}">\n' + "\n".join(parts) + "\n</robot>\n"


def rpy(values: Array) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(values), np.sin(values)
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return Rz @ Ry @ Rx


def cross_matrix(v: Array) -> Array:
    """``cross_matrix(v) @ x = v x x``."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def about(axis: Array, angle: float) -> Array:
    """The rotation by an angle about a unit vector."""
    K = cross_matrix(axis)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@dataclass
class Moving:
    """Pose, velocity and acceleration of a link in world axes, and the Jacobians of its origin."""

    R: Array
    p: Array
    w: Array
    v: Array
    alpha: Array
    a: Array
    Jv: Array
    Jw: Array


class Oracle:
    """The robot of a URDF text at one state. ``names``: the links whose joints move, in the order of q."""

    def __init__(self, text: str, names: list[str], q: Array, qd: Array, qdd: Array) -> None:
        self.root = ElementTree.fromstring(text)
        self.index = {name: k for k, name in enumerate(names)}
        self.state = q, qd, qdd
        self.n = len(names)
        zero = np.zeros(3)
        zeros = np.zeros((3, self.n))
        joints = {self._link(joint, "child"): joint for joint in self.root.findall("joint")}
        self.joints = joints
        self.links: dict[str, Moving] = {}
        elements = {link.get("name", ""): link for link in self.root.findall("link")}
        while len(self.links) < len(elements):
            for name in elements:
                if name not in joints:
                    self.links[name] = Moving(np.eye(3), zero, zero, zero, zero, zero, zeros, zeros)
                elif name not in self.links and self._link(joints[name], "parent") in self.links:
                    self.links[name] = self._moved(self.links[self._link(joints[name], "parent")], name)
        self.elements = elements

    @staticmethod
    def _link(joint: ElementTree.Element, end: str) -> str:
        return joint.find(end).get("link")  # pyright: ignore

    @staticmethod
    def _vector(element: ElementTree.Element | None, key: str, default: str = "0 0 0") -> Array:
        text = default if element is None else element.get(key, default)
        return np.array([float(word) for word in text.split()])

    def _moved(self, parent: Moving, name: str) -> Moving:
        q, qd, qdd = self.state
        joint = self.joints[name]
        origin = joint.find("origin")
        r = parent.R @ self._vector(origin, "xyz")
        R = parent.R @ rpy(self._vector(origin, "rpy"))
        axis = self._vector(joint.find("axis"), "xyz", "1 0 0")
        z = R @ axis / np.linalg.norm(axis)
        spin, spin_rate, slide, slide_rate, slide_acceleration = 0.0, 0.0, 0.0, 0.0, 0.0
        w, alpha, Jw, Jslide = parent.w, parent.alpha, parent.Jw.copy(), np.zeros((3, self.n))
        if joint.get("type") != "fixed":
            k = self.index[name]
            if joint.get("type") == "prismatic":
                slide, slide_rate, slide_acceleration = q[k], qd[k], qdd[k]
                Jslide[:, k] = z
            else:
                spin, spin_rate = qd[k], qdd[k]
                R = about(z, q[k]) @ R
                alpha = alpha + spin_rate * z + np.cross(parent.w, spin * z)
                w = w + spin * z
                Jw[:, k] = z
        r = r + slide * z
        omega, tilt = cross_matrix(parent.w), cross_matrix(parent.alpha)
        v = parent.v + omega @ r + slide_rate * z
        a = parent.a + tilt @ r + omega @ omega @ r + 2 * slide_rate * omega @ z + slide_acceleration * z
        Jv = parent.Jv - cross_matrix(r) @ parent.Jw + Jslide
        return Moving(R, parent.p + r, w, v, alpha, a, Jv, Jw)

    def pose(self, name: str) -> Array:
        """T of a link in the world."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.links[name].R, self.links[name].p
        return T

    def jacobian(self, name: str) -> Array:
        """Rows linear, then angular, at the link's origin."""
        return np.vstack((self.links[name].Jv, self.links[name].Jw))

    def dynamics(self) -> tuple[Array, Array]:
        """The inertia matrix, and the joint torques without friction; both with rotors."""
        M, tau = np.zeros((self.n, self.n)), np.zeros(self.n)
        for name, link in self.elements.items():
            inertial = link.find("inertial")
            if inertial is None:
                continue
            moving, origin = self.links[name], inertial.find("origin")
            mass = float(inertial.find("mass").get("value"))  # pyright: ignore
            i = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}  # pyright: ignore
            matrix = [
                [i["ixx"], i["ixy"], i["ixz"]],
                [i["ixy"], i["iyy"], i["iyz"]],
                [i["ixz"], i["iyz"], i["izz"]],
            ]
            R = moving.R @ rpy(self._vector(origin, "rpy"))
            inertia = R @ np.array(matrix) @ R.T
            c = cross_matrix(moving.R @ self._vector(origin, "xyz"))
            Jc = moving.Jv - c @ moving.Jw
            W = cross_matrix(moving.w)
            acceleration = moving.a - c @ moving.alpha - W @ c @ moving.w
            M += mass * Jc.T @ Jc + moving.Jw.T @ inertia @ moving.Jw
            tau += Jc.T @ (mass * (acceleration - GRAVITY)) + moving.Jw.T @ (
                inertia @ moving.alpha + W @ inertia @ moving.w
            )
        rotors = np.zeros(self.n)
        of_joint = {joint.get("name"): name for name, joint in self.joints.items()}
        for transmission in self.root.findall("transmission"):
            gear, rotor = (
                float(transmission.findtext(f"actuator/{key}"))
                for key in ("mechanicalReduction", "rotorInertia")
            )  # pyright: ignore
            rotors[self.index[of_joint[transmission.find("joint").get("name")]]] = gear**2 * rotor  # pyright: ignore
        return M + np.diag(rotors), tau + rotors * self.state[2]

    def friction(self) -> Array:
        """Joint friction: damping qd + friction sign(qd)."""
        tau = np.zeros(self.n)
        for name, k in self.index.items():
            dynamics = self.joints[name].find("dynamics")
            if dynamics is not None:
                qd = self.state[1][k]
                tau[k] = float(dynamics.get("damping", 0)) * qd + float(
                    dynamics.get("friction", 0)
                ) * np.sign(qd)
        return tau
