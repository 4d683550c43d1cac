"""Import XML of Simscape Multibody, which its plug-ins for CAD programs and ``smexportonshape`` write.

The file has a tree of instances of parts and subassemblies with poses, mass properties of parts, and joints
or mates between instances. A joint has a frame on each of its two instances, and moves about or along the z
axis of these frames; its coordinate is zero where the frames coincide. Mates are pairs of points, lines and
planes; the joint that remains has the coordinate zero in the assembled position.

Numbers are in the units of ``<DataUnits>``. ``<Inertia>`` is ``Ixx Iyy Izz Iyz Izx Ixy`` about the centre of
mass, along the axes of the part; the products are entries of the matrix. ``<Rotation>`` is a matrix by rows.

Source: MathWorks, *Simscape Multibody: CAD Translation*, and the elements of published files (versions 1.0
of SimMechanics Link and 2.0).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import PurePath

import numpy as np

from armblocks.errors import counted
from armblocks.formats.file_findings import FileContext
from armblocks.formats.simscape.assembly import GROUND, Assembly, Connection, Kind, Part
from armblocks.formats.simscape.mates import GEOMETRIES, Geometry, Motion, motion_of, rows_of
from armblocks.formats.simscape.rules import FRAMES, GEOMETRY, JOINT_CODE, MASS, MATE, UNITS
from armblocks.formats.simscape.units import LENGTHS, MASSES
from armblocks.formats.xml_elements import Element, note, read_elements, shortened
from armblocks.robot.checks import MAX_LINKS
from armblocks.spatial import Matrix3, Transform, matrix3

ROOTS = ("SimscapeMultibodyImportXML", "SimMechanicsImportXML")
"""The root elements of this format."""
FIRST_GENERATION = "PhysicalModelingXMLFile"
"""The root element of the first generation, which is refused."""
JOINT_KINDS = {
    "weld": Kind.WELD,
    "fixed": Kind.WELD,
    "rigid": Kind.WELD,
    "revolute": Kind.REVOLUTE,
    "prismatic": Kind.PRISMATIC,
}
MAX_MATES = 10 * MAX_LINKS
"""Maximum number of mates of an assembly."""
_TOLERANCE = 1e-6


def read_assembly(data: bytes, file: str, context: FileContext) -> Assembly:
    """The assembly of a file. Findings are added to the context.

    Raises ``FormatError`` with file and line for XML that cannot be read, and for unknown instances, parts
    and units. Joints and mates that leave other degrees of freedom than one rotation or one translation raise
    it, too.
    """
    root = read_elements(data, file)
    name = root.tag.rpartition(":")[2]
    if name not in ROOTS:
        generation = ", the first generation of SimMechanics Link" if name == FIRST_GENERATION else ""
        raise root.error(
            f"the root element is <{shortened(root.tag)}>{generation}",
            allowed=f"<{ROOTS[0]}> or <{ROOTS[1]}>",
            fix="export the assembly with Simscape Multibody Link",
        )
    return _Reader(root, context).assembly()


@dataclass(kw_only=True, eq=False)
class _Instance:
    """An instance of a part or subassembly: the path of its uids, its pose in the world, and its entity."""

    path: tuple[str, ...]
    element: Element
    pose: Transform
    entity: str
    children: list[_Instance] = field(default_factory=list["_Instance"])

    @property
    def node(self) -> str:
        """The name of its node; the root is the ground."""
        return "/".join(self.path) if self.path else GROUND


class _Mate:
    """A mate of two instances."""

    def __init__(
        self, element: Element, ends: tuple[str, str], geometries: tuple[Geometry, Geometry]
    ) -> None:
        self.element = element
        self.ends = ends
        self.rows = rows_of(element.attributes.get("type", element.tag), *geometries)


class _Reader:
    def __init__(self, root: Element, context: FileContext) -> None:
        self._root = root
        self._context = context
        self._mass, self._length = self._units()
        assembly = root.first("RootAssembly")
        if assembly is None:
            raise root.error("there is no <RootAssembly>", allowed="one assembly", fix="export it again")
        self._top = assembly
        self._parts = {part.attributes.get("uid", ""): part for part in _inside(root, "Parts", "Part")}
        self._assemblies = {
            entry.attributes.get("uid", ""): entry for entry in _inside(root, "Assemblies", "Assembly")
        }
        self._instances: dict[tuple[str, ...], _Instance] = {}
        self._joints: list[Connection] = []
        self._mates: list[_Mate] = []

    def assembly(self) -> Assembly:
        """The parts, and the connections between them."""
        top = self._tree()
        name = self._top.attributes.get("name", "").strip() or PurePath(self._root.file).stem
        assembly = Assembly(name=name, where=self._top.where)
        for instance in self._instances.values():
            if instance.entity in self._parts:
                assembly.parts[instance.node] = self._part(instance)
        assembly.poses = {instance.node: instance.pose for instance in self._instances.values()}
        for instance in [top, *self._instances.values()]:
            assembly.connections += self._rigid(instance)
            source = self._top if instance is top else self._assemblies.get(instance.entity)
            if source is not None:
                for joint in _all_inside(source, "Joints"):
                    assembly.connections.append(self._joint(joint, instance))
                for mate in _all_inside(source, "Constraints"):
                    self._mates += self._mate(mate, instance)
                    if len(self._mates) > MAX_MATES:
                        raise mate.error("the assembly has too many mates", allowed=f"at most {MAX_MATES}")
        assembly.connections += self._mated(assembly)
        self._note_left_out()
        return assembly

    def _units(self) -> tuple[float, float]:
        units = self._root.first("DataUnits")
        if units is None:
            note(self._context, UNITS, self._root, "there is no <DataUnits>; kg and m are used")
            return 1.0, 1.0
        factors: list[float] = []
        for attribute, known in (("mass", MASSES), ("length", LENGTHS)):
            word = units.required(attribute, ", ".join(known))
            if word.lower() not in known:
                raise units.error(f"the unit of {attribute} is '{shortened(word)}'", allowed=", ".join(known))
            factors.append(known[word.lower()])
        return factors[0], factors[1]

    def _tree(self) -> _Instance:
        """The root, with the instances in it, which are entered by their paths."""
        top = _Instance(path=(), element=self._top, pose=Transform(), entity="")
        waiting = [(child, top) for child in reversed([*_inside(self._top, "InstanceTree", "Instance")])]
        while waiting:
            element, parent = waiting.pop()
            uid = element.required("uid", "the identifier of the instance")
            path = (*parent.path, uid)
            entity = element.attributes.get("entityUid", "").strip()
            children = [*element.all("Instance")]
            if path in self._instances or len(self._instances) > 4 * MAX_LINKS:
                raise element.error(
                    "there is another instance with this uid, or there are too many",
                    allowed=f"unique identifiers, at most {4 * MAX_LINKS}",
                )
            if not children and entity not in self._parts and entity not in self._assemblies:
                raise element.error(
                    f"there is no part '{shortened(entity)}'",
                    allowed="the uid of a <Part>",
                    fix="export it again",
                )
            pose = parent.pose @ self._transform(element.first("Transform"))
            instance = _Instance(path=path, element=element, pose=pose, entity=entity)
            self._instances[path] = instance
            parent.children.append(instance)
            waiting += [(child, instance) for child in reversed(children)]
        return top

    def _part(self, instance: _Instance) -> Part:
        part = self._parts[instance.entity]
        label = "/".join(
            self._instances[instance.path[:k]].element.attributes.get("name", "").strip() or uid
            for k, uid in enumerate(instance.path, start=1)
        )
        place = part.first("MassProperties") or part
        texts = [place.first(tag) for tag in ("Mass", "CenterOfMass", "Inertia")]
        if None in texts:
            note(self._context, MASS, part, "it has no mass properties; its mass is read as zero")
        mass, centre, inertia = texts
        kilograms = mass.text_numbers(1)[0] * self._mass if mass is not None else 0.0
        if mass is not None and kilograms < 0:
            raise mass.error(f"the mass is {kilograms:g} kg", allowed="zero or more", fix="correct the sign")
        x, y, z = (
            [value * self._length for value in centre.text_numbers(3)] if centre is not None else (0.0,) * 3
        )
        factor = self._mass * self._length**2
        six = [value * factor for value in inertia.text_numbers(6)] if inertia is not None else [0.0] * 6
        xx, yy, zz, yz, xz, xy = six
        matrix: Matrix3 = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        return Part(label=label, line=instance.element.line, mass=kilograms, centre=(x, y, z), inertia=matrix)

    def _transform(self, element: Element | None) -> Transform:
        if element is None:
            return Transform()
        rotation, translation = element.first("Rotation"), element.first("Translation")
        x, y, z = (
            [value * self._length for value in translation.text_numbers(3)]
            if translation is not None
            else (0.0,) * 3
        )
        if rotation is None:
            return Transform(translation=(x, y, z))
        R = np.array(rotation.text_numbers(9)).reshape(3, 3)
        if not np.allclose(R @ R.T, np.eye(3), atol=1e-4) or np.linalg.det(R) < 0:
            raise rotation.error(
                "the nine numbers are not a rotation", allowed="a rotation matrix, row by row"
            )
        # The nearest rotation: files have few digits.
        U, _, V = np.linalg.svd(R)
        exact = R if np.allclose(R @ R.T, np.eye(3), atol=1e-15) else U @ V
        return Transform(rotation=matrix3(exact), translation=(x, y, z))

    def _rigid(self, instance: _Instance) -> Iterator[Connection]:
        """Welds of grounded children to the assembly, of rigid groups, and of rigid assemblies."""
        groups: dict[str, _Instance] = {}
        rigid = instance.element.attributes.get("rigid", "").strip().lower() == "true"
        for child in instance.children:
            texts = child.element.attributes
            if rigid or texts.get("grounded", "").strip().lower() == "true":
                yield self._weld(instance, child)
            group = texts.get("rigidGroup", "").strip()
            if group:
                first = groups.setdefault(group, child)
                if first is not child:
                    yield self._weld(first, child)

    def _weld(self, a: _Instance, b: _Instance) -> Connection:
        T = a.pose.inverse() @ b.pose
        return Connection("weld", b.element.where, Kind.WELD, a.node, b.node, T, Transform())

    def _end(self, end: Element, inside: _Instance) -> _Instance | None:
        """The instance of a path relative to an assembly; ``None`` for the assembly of the whole file."""
        path = end.first("InstancePath")
        uids = tuple(uid.text for uid in path.all("Uid")) if path is not None else ()
        own = inside.entity or self._top.attributes.get("uid", "")
        if uids[:1] == (own,) and (*inside.path, own) not in self._instances:
            uids = uids[1:]  # files of SolidWorks name the assembly itself
        full = (*inside.path, *uids)
        if not full:
            return None
        if full not in self._instances:
            raise end.error(
                f"there is no instance '{shortened('/'.join(uids))}'",
                allowed="the uids of instances",
                fix="export it again",
            )
        return self._instances[full]

    def _joint(self, joint: Element, inside: _Instance) -> Connection:
        word = joint.attributes.get("type", joint.tag).lower().removesuffix("joint")
        if word not in JOINT_KINDS:
            raise joint.error(
                f"the joint '{shortened(joint.attributes.get('name', ''))}' is of type "
                f"'{shortened(joint.tag)}', which is not supported [{JOINT_CODE}]",
                allowed="Revolute, Prismatic, Weld",
                fix="replace it by such joints in the CAD assembly",
            )
        nodes: list[str] = []
        frames: list[Transform] = []
        poses: list[Transform] = []
        for tag in ("BaseFrame", "FollowerFrame"):
            end = joint.first(tag)
            if end is None:
                raise joint.error(f"the joint has no <{tag}>", allowed="<BaseFrame> and <FollowerFrame>")
            instance = self._end(end, inside)
            nodes.append(GROUND if instance is None else instance.node)
            poses.append(Transform() if instance is None else instance.pose)
            frames.append(self._transform(end.first("Transform")))
        kind = JOINT_KINDS[word]
        before, after = frames[0], frames[1].inverse()
        moved = (poses[0] @ before).inverse() @ poses[1] @ frames[1]
        if not _is_motion(moved, kind):
            what = "its frames do not agree in the assembled position, in which its coordinate is zero here"
            note(self._context, FRAMES, joint, what)
            after = before.inverse() @ poses[0].inverse() @ poses[1]
        name = joint.attributes.get("name", "").strip() or "joint"
        return Connection(name, joint.where, kind, nodes[0], nodes[1], before, after)

    def _mate(self, mate: Element, inside: _Instance) -> Iterator[_Mate]:
        """A mate with its geometry in the world; a finding if it is not known."""
        nodes: list[str] = []
        geometries: list[Geometry] = []
        for end in mate.all("ConstraintGeometry"):
            instance = self._end(end, inside)
            pose = Transform() if instance is None else instance.pose
            kind = GEOMETRIES.get(end.attributes.get("geomType", "").strip().lower())
            position, axis = end.first("Position"), end.first("Axis")
            if kind is None or position is None or (axis is None and kind != "point"):
                break
            x, y, z = (value * self._length for value in position.text_numbers(3))
            direction = np.array(axis.text_numbers(3) if axis is not None else (0.0, 0.0, 0.0))
            size = float(np.linalg.norm(direction))
            if kind != "point" and size < 1e-9:
                raise end.error("the axis is zero", allowed="a direction")
            nodes.append(GROUND if instance is None else instance.node)
            unit = pose.R @ direction / (size or 1.0)
            geometries.append(Geometry(kind, np.array(pose.apply((x, y, z))), unit))
        found = (
            _Mate(mate, (nodes[0], nodes[1]), (geometries[0], geometries[1]))
            if len(geometries) == 2
            else None
        )
        if found is None or found.rows is None:
            types = ", ".join(end.attributes.get("geomType", "") for end in mate.all("ConstraintGeometry"))
            what = f"the mate '{shortened(mate.tag)}' of {shortened(types) or 'nothing'} is omitted"
            note(self._context, MATE, mate, what)
        else:
            yield found

    def _mated(self, assembly: Assembly) -> list[Connection]:
        """The joints that remain between groups of welded nodes under all mates."""
        poses = {GROUND: Transform(), **assembly.poses}
        groups = _Groups([c for c in assembly.connections if c.kind is Kind.WELD])
        found: list[Connection] = []
        known: dict[tuple[int, ...], Motion] = {}
        while True:
            pairs: dict[tuple[str, str], list[_Mate]] = {}
            for mate in self._mates:
                a, b = (groups.leader(end) for end in mate.ends)
                if a != b:
                    pairs.setdefault((min(a, b), max(a, b)), []).append(mate)
            motions: dict[tuple[str, str], Motion] = {}
            for pair, mates in pairs.items():
                key = tuple(map(id, mates))
                if key not in known:
                    known[key] = motion_of([mate.rows for mate in mates if mate.rows is not None])
                motions[pair] = known[key]
            welds = [pair for pair, motion in motions.items() if motion.kind is Kind.WELD]
            if not welds:
                break
            for a, b in welds:
                mate = pairs[a, b][0]
                found.append(_connection(mate, Kind.WELD, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), poses))
                groups.join(a, b)
        for pair, motion in motions.items():
            mates = pairs[pair]
            if motion.kind is None:
                names = " and ".join(f"'{shortened(end)}'" if end else "the ground" for end in mates[0].ends)
                freedoms = (
                    "a screw motion" if motion.freedoms == 1 else f"{motion.freedoms} degrees of freedom"
                )
                raise mates[0].element.error(
                    f"the mates of {names} leave {freedoms}, which is not supported [{JOINT_CODE}]",
                    allowed="one rotation, one translation, or none",
                    fix="add or replace mates in the CAD assembly",
                )
            found.append(_connection(mates[0], motion.kind, motion.position, motion.axis, poses))
        return found

    def _note_left_out(self) -> None:
        files = [file for part in self._parts.values() for file in part.all("GeometryFile")]
        if files:
            note(
                self._context,
                GEOMETRY,
                files[0],
                f"{counted(len(files), 'geometry file is', 'geometry files are')} not shown",
            )


class _Groups:
    """Groups of welded nodes (union-find)."""

    def __init__(self, welds: Sequence[Connection]) -> None:
        self._leaders: dict[str, str] = {}
        for weld in welds:
            self.join(weld.base, weld.follower)

    def leader(self, node: str) -> str:
        """The node that represents the group of a node."""
        while self._leaders.get(node, node) != node:
            node = self._leaders[node] = self._leaders.get(self._leaders[node], self._leaders[node])
        return node

    def join(self, a: str, b: str) -> None:
        """Join the groups of two nodes."""
        self._leaders[self.leader(b)] = self.leader(a)


def _connection(
    mate: _Mate,
    kind: Kind,
    position: tuple[float, float, float],
    axis: tuple[float, float, float],
    poses: dict[str, Transform],
) -> Connection:
    """The connection of the ends of a mate, with its axis in the world."""
    base, follower = mate.ends
    at = Transform(translation=position)
    before, after = poses[base].inverse() @ at, at.inverse() @ poses[follower]
    name = mate.element.attributes.get("name", "").strip() or "joint"
    return Connection(name, mate.element.where, kind, base, follower, before, after, axis)


def _is_motion(T: Transform, kind: Kind) -> bool:
    """Whether a pose is a motion about or along z."""
    x, y, z = T.translation
    turned = abs(T.rotation[2][2] - 1) > _TOLERANCE
    if kind is Kind.REVOLUTE:
        return not turned and max(abs(x), abs(y), abs(z)) < _TOLERANCE
    turned = turned or abs(T.rotation[0][0] - 1) > _TOLERANCE
    return not turned and max(abs(x), abs(y), 0.0 if kind is Kind.PRISMATIC else abs(z)) < _TOLERANCE


def _inside(parent: Element, section: str, tag: str) -> Iterator[Element]:
    return (child for part in parent.all(section) for child in part.all(tag))


def _all_inside(parent: Element, section: str) -> Iterator[Element]:
    return (child for part in parent.all(section) for child in part.children)
