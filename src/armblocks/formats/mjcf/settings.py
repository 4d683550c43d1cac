"""The settings ``<compiler>`` of an MJCF file, and its default classes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from armblocks.formats.xml_elements import Element, shortened

ACTUATORS = frozenset(
    (
        *("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle"),
        *("adhesion", "plugin", "dcmotor"),
    )
)
"""The elements of actuators. A default class has one set of attributes for all of them."""
MAIN = "main"
"""The name of the outermost default class."""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How numbers and shapes of the file are read.

    ``angle_unit``: rad per unit of the file's angles. ``euler_order``: axes of Euler angles, lower case about
    moving axes, upper case about fixed axes. ``inertia_from_shapes``: ``None`` for bodies without
    ``<inertial>`` only. ``groups``: range of the shape groups that have mass. ``total_mass``: kg, to which
    all masses are scaled.
    """

    angle_unit: float = math.pi / 180.0
    euler_order: str = "xyz"
    limits_by_range: bool = True
    inertia_from_shapes: bool | None = None
    groups: tuple[float, float] = (0.0, 5.0)
    mesh_folder: str = ""
    only_file_names: bool = False
    least_mass: float = 0.0
    least_inertia: float = 0.0
    balances_inertia: bool = False
    total_mass: float | None = None
    discards_visuals: bool = False


def settings_of(root: Element) -> Settings:
    """The settings of all sections ``<compiler>``; later attributes override earlier attributes."""
    settings = Settings()
    for compiler in root.all("compiler"):
        settings = _with(settings, compiler)
    return settings


def _with(settings: Settings, compiler: Element) -> Settings:
    texts = {name: value.strip() for name, value in compiler.attributes.items()}
    if "coordinate" in texts and texts["coordinate"] != "local":
        raise compiler.error(
            f"the coordinates are '{shortened(texts['coordinate'])}'",
            allowed="local coordinates",
            fix="convert the file with a version of MuJoCo before 2.3.4",
        )
    changes: dict[str, object] = {}
    if "angle" in texts:
        changes["angle_unit"] = 1.0 if texts["angle"] == "radian" else math.pi / 180.0
    if "eulerseq" in texts:
        order = texts["eulerseq"]
        if len(order) != 3 or set(order.lower()) - set("xyz"):
            raise compiler.error(
                f"the order of Euler angles is '{shortened(order)}'", allowed="three of x, y, z, X, Y, Z"
            )
        changes["euler_order"] = order
    if "inertiafromgeom" in texts:
        changes["inertia_from_shapes"] = {"true": True, "false": False}.get(texts["inertiafromgeom"])
    if "inertiagrouprange" in texts:
        low, high = compiler.numbers("inertiagrouprange", (2,))
        changes["groups"] = (low, high)
    for name, field in (("assetdir", "mesh_folder"), ("meshdir", "mesh_folder")):
        if name in texts:
            changes[field] = texts[name]
    for name, field in (("boundmass", "least_mass"), ("boundinertia", "least_inertia")):
        if name in texts:
            changes[field] = compiler.number(name)
    for name, field in (
        ("autolimits", "limits_by_range"),
        ("strippath", "only_file_names"),
        ("balanceinertia", "balances_inertia"),
        ("discardvisual", "discards_visuals"),
    ):
        if name in texts:
            changes[field] = texts[name] == "true"
    if "settotalmass" in texts and compiler.number("settotalmass") > 0:
        changes["total_mass"] = compiler.number("settotalmass")
    return replace(settings, **changes)  # pyright: ignore[reportArgumentType] - fields by name


class Defaults:
    """The default classes of a file: attributes by class and tag."""

    def __init__(self, root: Element) -> None:
        self._classes: dict[str, dict[str, dict[str, str]]] = {MAIN: {}}
        for section in root.all("default"):
            # The outermost class may have another name, which is then a second name of the same class.
            self._classes[section.attributes.get("class", MAIN)] = self._classes[MAIN]
            self._read(section, MAIN, {})

    def _read(self, element: Element, name: str, inherited: Mapping[str, Mapping[str, str]]) -> None:
        own = self._classes.setdefault(name, {})
        for tag, attributes in inherited.items():
            own.setdefault(tag, {}).update(attributes)
        for child in element.children:
            if child.tag != "default":
                own.setdefault(_default_tag(child.tag), {}).update(child.attributes)
        for child in element.all("default"):
            self._read(child, child.required("class", "the name of the default class"), own)

    def applied(self, element: Element, inherited_class: str = MAIN) -> Element:
        """The element with the attributes of its default class, by default ``inherited_class``."""
        name = element.attributes.get("class", inherited_class)
        if name not in self._classes:
            raise element.error(
                f"the default class '{shortened(name)}' does not exist",
                allowed=", ".join(sorted(self._classes)[:20]),
                fix="define it in <default>",
            )
        attributes = {**self._classes[name].get(_default_tag(element.tag), {}), **element.attributes}
        return replace(element, attributes=attributes)


def _default_tag(tag: str) -> str:
    """The tag under which a default class stores the attributes of elements with ``tag``."""
    return "general" if tag in ACTUATORS else tag


def sections(root: Element, tag: str) -> Iterator[Element]:
    """The children of all sections with a tag."""
    return (child for section in root.all(tag) for child in section.children)
