"""SDF texts of the robots of URDF texts, and an oracle of the pose semantics of SDF in NumPy.

The links of the SDF have other frames than those of the URDF, and poses are given relative to models, links,
joints and frames, in rad, degrees and quaternions. Some joints are written from child to parent. Neither the
conversion nor the oracle shares code with the package.
"""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
from urdf_trees import about, numbers, rpy

Array = np.ndarray
MOMENTS = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}


def transform(R: Array, p: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def _vector(element: ElementTree.Element | None, key: str, default: str = "0 0 0") -> Array:
    return np.array(
        [float(word) for word in (default if element is None else element.get(key, default)).split()]
    )


def _origin(element: ElementTree.Element) -> Array:
    origin = element.find("origin")
    return transform(rpy(_vector(origin, "rpy")), _vector(origin, "xyz"))


def angles(R: Array) -> Array:
    """Roll, pitch, yaw of a rotation without singularity."""
    return np.array([np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(R[2, 0]), np.arctan2(R[1, 0], R[0, 0])])


def quaternion(R: Array) -> Array:
    """x, y, z, w."""
    values, vectors = np.linalg.eigh(
        np.array(
            [
                [R[0, 0] - R[1, 1] - R[2, 2], R[1, 0] + R[0, 1], R[2, 0] + R[0, 2], R[2, 1] - R[1, 2]],
                [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], R[2, 1] + R[1, 2], R[0, 2] - R[2, 0]],
                [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], R[1, 0] - R[0, 1]],
                [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)],
            ]
        )
        / 3
    )
    return vectors[:, np.argmax(values)]


class Conversion:
    """The text ``sdf`` of a URDF text; ``offsets[link]``: the SDF frame in the URDF frame; ``base``."""

    def __init__(self, urdf: str, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.root = ElementTree.fromstring(re.sub(r"<transmission.*?</transmission>", "", urdf))
        joints = {joint.find("child").get("link"): joint for joint in self.root.findall("joint")}  # pyright: ignore
        links = {link.get("name", ""): link for link in self.root.findall("link")}
        at: dict[str, Array] = {}
        while len(at) < len(links):
            for name in links:
                if name not in joints:
                    at[name] = np.eye(4)
                elif joints[name].find("parent").get("link") in at:  # pyright: ignore
                    at[name] = at[joints[name].find("parent").get("link")] @ _origin(joints[name])  # pyright: ignore
        self.offsets = {name: self.pose() for name in links}
        self.known: dict[str, Array] = {"__model__": np.eye(4)}
        self.base = self.pose()
        parts = [f'<model name="robot">{self.text(np.eye(4), self.base)}']
        for name, link in links.items():
            point = at[name] @ self.offsets[name]
            parts.append(f'<link name="{name}">{self.placed(point)}{self.inertial(link, name)}</link>')
            self.known[name] = point
            turned = point @ self.pose()
            parts.append(f'<frame name="f_{name}" attached_to="{name}">{self.text(point, turned)}</frame>')
            self.known[f"f_{name}"] = turned
        (first,) = (name for name in links if name not in joints)
        parts.append(
            f'<joint name="anchor" type="fixed"><parent>world</parent><child>{first}</child></joint>'
        )
        parts += [self.joint(joint, at) for joint in self.root.findall("joint")]
        body = "\n".join(parts)
        self.sdf = f'<sdf version="1.9">\n{body}\n</model></sdf>'

    def pose(self) -> Array:
        return transform(rpy(self.random.uniform(-1.5, 1.5, 3)), self.random.normal(size=3))

    def text(self, frame: Array, pose: Array, attributes: str = "") -> str:
        """A ``<pose>`` of a frame relative to another one, both given in the model."""
        T = np.linalg.inv(frame) @ pose
        p, form = numbers(T[:3, 3]), self.random.integers(3)
        if form == 0:
            return f"<pose{attributes}>{p} {numbers(angles(T[:3, :3]))}</pose>"
        if form == 1:
            return f'<pose{attributes} degrees="true">{p} {numbers(np.degrees(angles(T[:3, :3])))}</pose>'
        return (
            f'<pose{attributes} rotation_format="quat_xyzw">{p} {numbers(3 * quaternion(T[:3, :3]))}</pose>'
        )

    def placed(self, pose: Array, default: str = "__model__") -> str:
        """A ``<pose>`` relative to a known frame, or to the default one without saying so."""
        name = default if self.random.random() < 0.3 else str(self.random.choice(list(self.known)))
        return self.text(self.known[name], pose, "" if name == default else f' relative_to="{name}"')

    def inertial(self, link: ElementTree.Element, name: str) -> str:
        inertial = link.find("inertial")
        mass, moment, centre = 0.0, np.zeros((3, 3)), np.eye(4)
        if inertial is not None:
            mass, centre = float(inertial.find("mass").get("value")), _origin(inertial)  # pyright: ignore
            for key, (i, j) in MOMENTS.items():
                moment[i, j] = moment[j, i] = float(inertial.find("inertia").get(key))  # pyright: ignore
        turn = rpy(self.random.uniform(-1, 1, 3))
        moment = turn.T @ moment @ turn
        entries = "".join(f"<{key}>{float(moment[i])!r}</{key}>" for key, i in MOMENTS.items())
        pose = self.text(self.offsets[name], centre @ transform(turn, np.zeros(3)))
        return f"<inertial>{pose}<mass>{mass!r}</mass><inertia>{entries}</inertia></inertial>"

    def joint(self, joint: ElementTree.Element, at: dict[str, Array]) -> str:
        kind, name = joint.get("type"), joint.get("name", "")
        parent, child = (joint.find(end).get("link") for end in ("parent", "child"))  # pyright: ignore
        axis = _vector(joint.find("axis"), "xyz", "1 0 0")
        axis /= np.linalg.norm(axis)
        pose = at[child] @ transform(rpy(self.random.uniform(-1, 1, 3)), axis * self.random.normal())
        axis = at[child][:3, :3] @ axis  # in the model
        if self.random.random() < 0.3:
            parent, child, axis = child, parent, -axis
        child = f"f_{child}" if self.random.random() < 0.3 else child
        text = f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>'
        text += self.placed(pose, default=child)
        self.known[name] = pose
        if kind != "fixed":
            frame = str(self.random.choice(list(self.known)))
            expressed = "" if frame == name else f' expressed_in="{frame}"'
            limit, dynamics = joint.find("limit"), joint.find("dynamics")
            given_axis = self.known[frame][:3, :3].T @ axis
            text += f"<axis><xyz{expressed}>{numbers(given_axis)}</xyz><limit>"
            text += "".join(f"<{key}>{value}</{key}>" for key, value in limit.attrib.items())  # pyright: ignore
            text += "</limit>"
            if dynamics is not None:
                text += "<dynamics>"
                text += "".join(f"<{key}>{value}</{key}>" for key, value in dynamics.attrib.items())
                text += "</dynamics>"
            text += "</axis>"
        return text + "</joint>"


class Oracle:
    """Poses of the links of an SDF text with one model at coordinates ``q[joint]``, by its definitions."""

    def __init__(self, text: str, q: dict[str, float]) -> None:
        model = ElementTree.fromstring(text).find("model")
        assert model is not None
        self.elements = {e.get("name", ""): e for e in model if e.tag in ("link", "joint", "frame")}
        self.q = q
        self.base = self.own_pose(model)
        self.links: dict[str, Array] = {}
        self.joints = {name: e for name, e in self.elements.items() if e.tag == "joint"}
        remaining = dict(self.joints)
        while remaining:
            for name, joint in list(remaining.items()):
                parent, child = (self.link(joint.findtext(end, "")) for end in ("parent", "child"))
                J, motion = self.initial(name), self.motion(name)
                if parent == "world" or parent in self.links:
                    before = np.eye(4) if parent == "world" else self.initial(parent)
                    moved = self.base if parent == "world" else self.links[parent]
                    self.links[child] = (
                        moved @ np.linalg.inv(before) @ J @ motion @ np.linalg.inv(J) @ self.initial(child)
                    )
                elif child in self.links:
                    T = (
                        np.linalg.inv(self.initial(parent))
                        @ J
                        @ motion
                        @ np.linalg.inv(J)
                        @ self.initial(child)
                    )
                    self.links[parent] = self.links[child] @ np.linalg.inv(T)
                else:
                    continue
                del remaining[name]

    def link(self, name: str) -> str:
        """The link of a frame."""
        while name != "world" and self.elements[name].tag != "link":
            name = self.elements[name].get("attached_to", "")
        return name

    def own_pose(self, element: ElementTree.Element) -> Array:
        """The numbers of a ``<pose>``."""
        pose = element.find("pose")
        if pose is None:
            return np.eye(4)
        values = np.array([float(word) for word in (pose.text or "").split()])
        if len(values) == 7:
            x, y, z, w = values[3:] / np.linalg.norm(values[3:])
            v = np.array([x, y, z])
            angle = 2 * np.arctan2(np.linalg.norm(v), w)
            return transform(about(v / np.linalg.norm(v), angle), values[:3])
        factor = np.pi / 180 if pose.get("degrees") == "true" else 1.0
        return transform(rpy(values[3:] * factor), values[:3])

    def initial(self, name: str) -> Array:
        """The pose of a frame in the model at q = 0."""
        if name == "__model__":
            return np.eye(4)
        element = self.elements[name]
        pose = element.find("pose")
        default = {
            "link": "__model__",
            "joint": element.findtext("child"),
            "frame": element.get("attached_to"),
        }
        parent = (None if pose is None else pose.get("relative_to")) or default[element.tag] or "__model__"
        return self.initial(parent) @ self.own_pose(element)

    def motion(self, name: str) -> Array:
        joint = self.joints[name]
        xyz = joint.find("axis/xyz")
        if xyz is None:
            return np.eye(4)
        frame = self.initial(xyz.get("expressed_in") or name)[:3, :3]
        axis = (
            self.initial(name)[:3, :3].T
            @ frame
            @ np.array([float(word) for word in (xyz.text or "").split()])
        )
        if joint.get("type") == "prismatic":
            return transform(np.eye(3), self.q[name] * axis)
        return transform(about(axis, self.q[name]), np.zeros(3))

    def body(self, name: str) -> tuple[float, Array, Array]:
        """Mass, centre of mass in the world, inertia about it in world axes."""
        inertial = self.elements[name].find("inertial")
        assert inertial is not None
        T = self.links[name] @ self.own_pose(inertial)
        moment = np.zeros((3, 3))
        for key, (i, j) in MOMENTS.items():
            moment[i, j] = moment[j, i] = float(inertial.findtext(f"inertia/{key}", "0"))
        return float(inertial.findtext("mass", "1")), T[:3, 3], T[:3, :3] @ moment @ T[:3, :3].T
