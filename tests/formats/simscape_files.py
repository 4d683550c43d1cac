"""CAD exports of Simscape Multibody, computed from the parameters and a configuration of a robot.

The part of each link has the frame of the link, in millimetres and grams. Some parts are in a subassembly
with a pose of its own.
"""

from __future__ import annotations

import numpy as np

from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames

Array = np.ndarray


def words(values: Array | list[float]) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


def turned_to(axis: Array) -> Array:
    """A homogeneous rotation (4, 4) whose z axis has the direction ``axis``."""
    z = np.asarray(axis) / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack((x, np.cross(z, x), z))
    return T


def transform(T: Array) -> str:
    rotation = f"<Rotation>{words(T[:3, :3])}</Rotation>"
    return f"<Transform>{rotation}<Translation>{words(T[:3, 3] * 1000)}</Translation></Transform>"


class Export:
    """The files for a robot at ``q``, with joints or, if ``mates`` is true, with mates instead of joints.

    In the joints of ``swapped``, the base frame is on the child and the follower frame on the parent.
    """

    def __init__(self, robot: Robot, q: Array, *, mates: bool = False) -> None:
        self.robot = robot
        self.mates = mates
        self.poses = dict(zip((link.name for link in robot.links), link_frames(robot, q)[1:]))
        self.poses[""] = np.eye(4)
        self.sub = {link.name for link in robot.links[1::2]}
        self.sub_pose = turned_to(np.array([1.0, 2.0, -1.0]))
        self.sub_pose[:3, 3] = 0.3, -0.2, 0.1
        moving = [link.name for link in robot.moving_links]
        self.swapped = set() if mates else set(moving[::3])

    def frames(self, name: str) -> tuple[Array, Array]:
        """The frames of a joint on the parent and on the link."""
        link = self.robot.link(name)
        A = turned_to(np.array(link.joint.axis))
        base = self.robot.base.matrix if link.parent is None else np.eye(4)
        moved = link.joint.motion(link.joint.neutral).matrix
        return base @ link.before.matrix @ moved @ A, np.linalg.inv(link.after.matrix) @ A

    def path(self, name: str, inside: bool) -> str:
        uids = ([] if inside or name not in self.sub else ["s1"]) + ([f"u-{name}"] if name else [])
        return "<InstancePath>" + "".join(f"<Uid>{uid}</Uid>" for uid in uids) + "</InstancePath>"

    def joint(self, name: str, inside: bool) -> str:
        link = self.robot.link(name)
        kind = {"Revolute": "Revolute", "Prismatic": "Prismatic", "Fixed": "Weld"}[type(link.joint).__name__]
        ends = list(zip((link.parent or "", name), self.frames(name)))
        if self.mates:
            return self.mate(kind, ends, inside)
        if name in self.swapped:
            ends.reverse()
        frames = "".join(
            f"<{tag}>{self.path(end, inside)}{transform(T)}</{tag}>"
            for tag, (end, T) in zip(("BaseFrame", "FollowerFrame"), ends)
        )
        return f'<{kind} name="{name} joint">{frames}</{kind}>'

    def mate(self, kind: str, ends: list[tuple[str, Array]], inside: bool) -> str:
        """Mates that leave the freedom of the joint: concentric axes and planes; for a weld, planes only."""
        (base, T), (follower, F) = ends
        moved = np.linalg.inv(self.poses[base] @ T) @ self.poses[follower] @ F

        def pair(tag: str, kinds: tuple[str, str], axis: int) -> str:
            # The axes of both frames agree in the assembled position.
            texts = ""
            for geometry, end, frame in zip(kinds, (base, follower), (T, F @ np.linalg.inv(moved))):
                position = words((F if end == follower and geometry == "cylinder" else frame)[:3, 3] * 1000)
                texts += (
                    f'<ConstraintGeometry geomType="{geometry}">{self.path(end, inside)}'
                    f"<Position>{position}</Position><Axis>{words(frame[:3, axis])}</Axis>"
                    "</ConstraintGeometry>"
                )
            return f'<{tag} name="{follower} {tag}">{texts}</{tag}>'

        if kind == "Weld":
            return "".join(pair("Coincident", ("plane", "plane"), axis) for axis in range(3))
        concentric = pair("Concentric", ("cylinder", "line"), 2)
        if kind == "Prismatic":
            return concentric + pair("Parallel", ("plane", "plane"), 0)
        return concentric + pair("Coincident", ("plane", "plane"), 2)

    def xml(self) -> str:
        instances, inner, parts = "", "", ""
        for link in self.robot.links:
            in_sub = link.name in self.sub
            pose = (np.linalg.inv(self.sub_pose) if in_sub else np.eye(4)) @ self.poses[link.name]
            text = (
                f'<Instance name="{link.name}" uid="u-{link.name}" entityUid="p-{link.name}">'
                f"{transform(pose)}</Instance>"
            )
            inner, instances = (inner + text, instances) if in_sub else (inner, instances + text)
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = np.array(link.inertia) * 1e9
            parts += (
                f'<Part name="{link.name}" uid="p-{link.name}"><MassProperties>'
                f"<Mass>{link.mass * 1000!r}</Mass>"
                f"<CenterOfMass>{words(np.array(link.centre_of_mass) * 1000)}</CenterOfMass>"
                f"<Inertia>{words([xx, yy, zz, yz, xz, xy])}</Inertia></MassProperties>"
                f'<GeometryFile name="{link.name}.STEP" type="STEP"/></Part>'
            )
        instances += (
            f'<Instance name="sub" uid="s1" entityUid="a1">{transform(self.sub_pose)}{inner}</Instance>'
        )
        outside, inside = "", ""
        for link in self.robot.links:
            both = {link.name, link.parent} <= self.sub
            text = self.joint(link.name, both)
            outside, inside = (outside, inside + text) if both else (outside + text, inside)
        section = "Constraints" if self.mates else "Joints"
        return (
            '<?xml version="1.0" encoding="utf-8"?>\n<SimscapeMultibodyImportXML version="2.0" '
            'xmlns="urn:mathworks:SimscapeMultibody:import"><Created by="" from="Test" using=""/>'
            '<ModelUnits mass="kilogram" length="meter"/><DataUnits mass="gram" length="millimeter"/>'
            f'<RootAssembly name="arm" uid="root"><InstanceTree>{instances}</InstanceTree>'
            f"<{section}>{outside}</{section}></RootAssembly>"
            f'<Assemblies><Assembly name="sub" uid="a1"><{section}>{inside}</{section}>'
            "</Assembly></Assemblies>"
            f"<Parts>{parts}</Parts></SimscapeMultibodyImportXML>"
        )

    def data_file(self) -> str:
        """The data file, with the instance ``NAME-1`` of each link."""
        lines = ["%%%VariableName:smiData", "smiData.RigidTransform(999).ID = '';"]
        numbers = {"Revolute": 0, "Prismatic": 0}
        for k, link in enumerate(self.robot.links):
            ends = [f"{link.parent}-1" if link.parent else "", f"{link.name}-1"]
            frames = list(self.frames(link.name))
            if link.name in self.swapped:
                ends.reverse(), frames.reverse()
            pair = ":-:".join(ends)
            for index, (letter, T) in enumerate(zip("BF", frames)):
                axis, angle = axis_and_angle(T[:3, :3])
                entry = f"smiData.RigidTransform({2 * k + index + 1})"
                lines += [
                    f"{entry}.translation = [{words(T[:3, 3] * 1000)}];  % mm",
                    f"{entry}.angle = {angle!r};  % rad",
                    f"{entry}.axis = [{words(axis)}];",
                    f"{entry}.ID = '{letter}[{pair}]';",
                ]
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = np.array(link.inertia) * 1e9
            solid = f"smiData.Solid({k + 1})"
            lines += [
                f"{solid}.mass = {link.mass * 1000!r};  % g",
                f"{solid}.CoM = [{words(np.array(link.centre_of_mass) * 1000)}];  % mm",
                f"{solid}.MoI = [{words([xx, yy, zz])}];  % g*mm^2",
                f"{solid}.PoI = [{words([yz, xz, xy])}];  % g*mm^2",
                f"{solid}.ID = '{link.name}*:*Default';",
            ]
            kind = type(link.joint).__name__
            if kind in numbers:
                numbers[kind] += 1
                joint = f"smiData.{kind}Joint({numbers[kind]})"
                field = "Rz" if kind == "Revolute" else "Pz"
                lines += [f"{joint}.{field}.Pos = start;  % deg", f'{joint}.ID = "[{pair}]";']
        return "\n".join(lines) + "\n"


def axis_and_angle(R: Array) -> tuple[Array, float]:
    """The axis and the angle of a rotation; the axis is the eigenvector for the eigenvalue 1."""
    values, vectors = np.linalg.eig(R)
    axis = np.real(vectors[:, int(np.argmin(np.abs(values - 1)))])
    axis /= np.linalg.norm(axis)
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    return axis, float(np.arctan2(np.cross(across, R @ across) @ axis, across @ (R @ across)))
