"""Data files ``*_DataFile.m``, which the function ``smimport`` writes beside an imported model.

They assign the numbers of the model's blocks to the fields of tables in a structure: rigid transforms, solids
and joints. Nothing is evaluated: only assignments of literals to these fields are read.

The names of the transforms contain the topology: ``B[a:-:b]`` is the pose of the joint between a and b in a,
``F[a:-:b]`` its pose in b. ``AssemblyGround[s:a]`` is the pose of the grounded part a in the subassembly s,
``RootGround[a]`` its pose in the world. ``SixDofRigidTransform[a]`` is the pose of a part that moves freely.
A table of joints such as ``RevoluteJoint`` has the names ``[a:-:b]`` of its joints; welds have no table.

Sources: MathWorks, *Simscape Multibody: smimport*, and the fields of published files.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePath
from typing import NamedTuple

from armblocks.errors import FormatError, counted
from armblocks.formats.file_findings import FileContext, FileFinding
from armblocks.formats.simscape.assembly import GROUND, Assembly, Connection, Kind, Part
from armblocks.formats.simscape.rules import JOINT_CODE, MASS
from armblocks.formats.simscape.units import LENGTHS, MASSES
from armblocks.spatial import Matrix3, Transform, Vector3, rotation_about

MAX_ENTRIES = 20_000
"""Maximum number of entries of a table."""
_ASSIGNMENT = re.compile(
    r"\s*[A-Za-z]\w{0,62}\.(?P<table>[A-Za-z]\w{0,62})\((?P<index>[0-9]{1,6})\)\.(?P<field>[A-Za-z][\w.]{0,62})"
    r"\s*=\s*(?P<value>[^%]*?|'[^']*'|\"[^\"]*\")\s*;\s*(?:%\s*(?P<unit>.*?))?\s*"
)
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,4})?")
_PAIR = re.compile(r"(?P<kind>[BF])\[(?P<base>.*):-:(?P<follower>.*)\]")
_GROUNDED = re.compile(r"(?P<kind>RootGround|AssemblyGround)\[(?P<path>.*)\]")
_FREE = re.compile(r"SixDofRigidTransform\[(?P<path>.*)\]")
_JOINT = re.compile(r"\[(?P<pair>.*:-:.*)\]")
_JOINT_KINDS = {"RevoluteJoint": Kind.REVOLUTE, "PrismaticJoint": Kind.PRISMATIC, "WeldJoint": Kind.WELD}


class _Field(NamedTuple):
    """The text of a value, its unit and its line."""

    text: str
    unit: str
    line: int


class _Entry(dict[str, _Field]):
    """The fields of one entry of a table."""


def read_data_file(data: bytes, file: str, context: FileContext) -> Assembly:
    """The assembly of a data file. Findings are added to the context.

    Raises ``FormatError`` with file and line for values that are not numbers, unknown units, transforms
    without a partner, and joints other than revolute, prismatic and weld.
    """
    return _Tables(data, file, context).assembly()


class _Tables:
    def __init__(self, data: bytes, file: str, context: FileContext) -> None:
        self._file = file
        self._context = context
        self._tables: dict[str, dict[int, _Entry]] = {}
        for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), start=1):
            match = _ASSIGNMENT.fullmatch(line) if len(line) <= 2000 else None
            if match is None:
                continue
            table = self._tables.setdefault(match["table"], {})
            index = int(match["index"])
            if index > MAX_ENTRIES:
                raise self._error(number, f"the table has an entry {index}", f"at most {MAX_ENTRIES}")
            entry = table.setdefault(index, _Entry())
            entry[match["field"]] = _Field(match["value"].strip(), (match["unit"] or "").strip(), number)

    def _error(self, line: int, what: str, allowed: str = "", fix: str = "correct this line") -> FormatError:
        return FormatError(what, where=f"{self._file}:{line}", allowed=allowed, fix=fix)

    def assembly(self) -> Assembly:
        """The parts with their masses, and the connections."""
        name = re.sub(r"_DataFile$", "", PurePath(self._file).stem) or "assembly"
        assembly = Assembly(name=name, where=self._file)
        kinds = self._joint_kinds()
        ends: dict[str, dict[str, tuple[Transform, int]]] = {}
        poses_of_free: dict[str, Transform] = {}
        for entry in self._entries("RigidTransform"):
            identifier, line = self._identifier(entry)
            pair, grounded = _PAIR.fullmatch(identifier), _GROUNDED.fullmatch(identifier)
            if pair is not None:
                key = f"{pair['base']}:-:{pair['follower']}"
                ends.setdefault(key, {})[pair["kind"]] = self._transform(entry), line
            elif (free := _FREE.fullmatch(identifier)) is not None:
                poses_of_free[free["path"]] = self._transform(entry)
            elif grounded is not None:
                path = grounded["path"]
                root = grounded["kind"] == "RootGround"
                base = GROUND if root else path.rpartition(":")[0]
                where = f"{self._file}:{line}"
                T = self._transform(entry)
                assembly.connections.append(
                    Connection("ground", where, Kind.WELD, base, path, T, Transform())
                )
        for key, poses in ends.items():
            assembly.connections.append(self._connection(key, poses, kinds))
        assembly.poses = poses_of_free
        nodes = [node for c in assembly.connections for node in (c.base, c.follower) if node != GROUND]
        nodes += poses_of_free
        grounds = {c.base for c in assembly.connections if c.name == "ground"}
        for node in dict.fromkeys(nodes):
            if node not in grounds:  # subassemblies have no mass of their own
                assembly.parts[node] = self._part(node)
        return assembly

    def _entries(self, table: str) -> list[_Entry]:
        """The entries in use: entries with a name."""
        entries = [entry for _, entry in sorted(self._tables.get(table, {}).items())]
        return [entry for entry in entries if self._identifier(entry)[0]]

    def _identifier(self, entry: _Entry) -> tuple[str, int]:
        """The text of the field ``ID``, and its line."""
        field = entry.get("ID")
        return ("", 0) if field is None else (field.text[1:-1], field.line)

    def _joint_kinds(self) -> Mapping[str, Kind]:
        """The kind of each joint by the names of its ends."""
        kinds: dict[str, Kind] = {}
        for table in self._tables:
            if not table.endswith("Joint"):
                continue
            for entry in self._entries(table):
                identifier, line = self._identifier(entry)
                match = _JOINT.fullmatch(identifier)
                if table not in _JOINT_KINDS:
                    raise self._error(
                        line,
                        f"the joint '{identifier[:60]}' is a {table[:40]}, not supported [{JOINT_CODE}]",
                        "RevoluteJoint, PrismaticJoint, and welds",
                        "replace it by such joints in the CAD assembly",
                    )
                if match is not None:
                    kinds[match["pair"]] = _JOINT_KINDS[table]
        return kinds

    def _connection(
        self, key: str, poses: Mapping[str, tuple[Transform, int]], kinds: Mapping[str, Kind]
    ) -> Connection:
        base, _, follower = key.partition(":-:")
        line = next(iter(poses.values()))[1]
        if len(poses) < 2:
            raise self._error(
                line,
                f"the joint '[{key[:60]}]' has only one of its transforms B[…] and F[…]",
                "both transforms",
                "import the assembly again",
            )
        kind = kinds.get(key, Kind.WELD)
        where = f"{self._file}:{line}"
        before, after = poses["B"][0], poses["F"][0].inverse()
        return Connection(follower or base, where, kind, base, follower, before, after)

    def _part(self, node: str) -> Part:
        """The part of an instance: the solid with its name without the number of the instance."""
        name = node.rpartition(":")[2] if not re.search(r":[0-9]+$", node) else node
        name = name.rpartition("/")[2]
        wanted = {name, re.sub(r"-[0-9]+$", "", name), re.sub(r":[0-9]+$", "", name)}
        solids = self._entries("Solid")
        names = [self._identifier(solid)[0].partition("*:*")[0] for solid in solids]
        found = [solid for solid, label in zip(solids, names) if label in wanted]
        if len(found) != 1:
            what = f"{len(found) or 'no'} solids have its name; its mass is read as zero"
            self._context.findings.append(
                FileFinding(rule=MASS, file=self._file, element=f"part '{node[:60]}'", what=what)
            )
            return Part(label=node)
        (solid,) = found
        line = self._identifier(solid)[1]
        mass = self._numbers(solid, "mass", 1, MASSES)[0]
        if mass < 0:
            raise self._error(
                solid["mass"].line, f"the mass is {mass:g} kg", "zero or more", "correct the sign"
            )
        x, y, z = self._numbers(solid, "CoM", 3, LENGTHS)
        xx, yy, zz = self._moments(solid, "MoI")
        yz, xz, xy = self._moments(solid, "PoI")
        matrix: Matrix3 = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        return Part(label=node, line=line, mass=mass, centre=(x, y, z), inertia=matrix)

    def _moments(self, solid: _Entry, field: str) -> list[float]:
        """Moments in kg m2, from a unit such as ``kg*mm^2``."""
        return self._numbers(solid, field, 3, {"": 1.0}, moments=True)

    def _transform(self, entry: _Entry) -> Transform:
        x, y, z = self._numbers(entry, "translation", 3, LENGTHS)
        (angle,) = self._numbers(entry, "angle", 1, {"rad": 1.0, "deg": 0.017453292519943295})
        axis = self._numbers(entry, "axis", 3, None)
        length = sum(value * value for value in axis) ** 0.5
        if angle == 0.0 or length == 0.0:
            return Transform(translation=(x, y, z))
        u, v, w = (value / length for value in axis)
        direction: Vector3 = (u, v, w)
        return Transform(rotation=rotation_about(direction, angle), translation=(x, y, z))

    def _numbers(
        self,
        entry: _Entry,
        field: str,
        count: int,
        units: Mapping[str, float] | None,
        *,
        moments: bool = False,
    ) -> list[float]:
        """The numbers of a field in SI units."""
        value = entry.get(field)
        if value is None:
            line = self._identifier(entry)[1]
            raise self._error(line, f"the entry has no field '{field}'", field, "import the assembly again")
        words = value.text.strip("[]").replace(",", " ").split()
        if len(words) != count or not all(_NUMBER.fullmatch(word) for word in words):
            raise self._error(
                value.line,
                f"'{value.text[:60]}' is not {counted(count, 'number')}",
                counted(count, "finite number"),
            )
        numbers = [float(word) for word in words]
        if not all(abs(number) < 1e300 for number in numbers):
            raise self._error(value.line, f"'{value.text[:60]}' is too large", "finite numbers")
        factor = self._moment_unit(value) if moments else self._unit(value, units)
        return [number * factor for number in numbers]

    def _unit(self, value: _Field, units: Mapping[str, float] | None) -> float:
        if units is None:
            return 1.0
        if value.unit.lower() not in units:
            raise self._error(value.line, f"the unit is '{value.unit[:40]}'", ", ".join(units))
        return units[value.unit.lower()]

    def _moment_unit(self, value: _Field) -> float:
        mass, _, length = value.unit.lower().partition("*")
        length = length.removesuffix("^2")
        if mass not in MASSES or length not in LENGTHS:
            raise self._error(value.line, f"the unit is '{value.unit[:40]}'", "a unit such as kg*mm^2")
        return MASSES[mass] * LENGTHS[length] ** 2
