"""Random MJCF texts with every way to write poses, inertias, defaults and frames that the reader supports."""

from __future__ import annotations

import numpy as np

Array = np.ndarray
SETTINGS = (
    "",
    'angle="radian"',
    'angle="radian" eulerseq="zyx"',
    'eulerseq="XYZ" inertiafromgeom="true"',
    'eulerseq="zXy" autolimits="false" boundmass="0.3" boundinertia="0.05"',
    'angle="radian" balanceinertia="true" settotalmass="7"',
)
SHAPES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}


def words(values: Array | list[float]) -> str:
    """Numbers as text that is read back exactly."""
    return " ".join(repr(float(value)) for value in np.ravel(values))


class RandomModel:
    """One model text; equal seeds give equal texts."""

    def __init__(self, seed: int, bodies: int = 7) -> None:
        self.random = np.random.default_rng(seed)
        self.settings = SETTINGS[seed % len(SETTINGS)]
        self.in_radian = "radian" in self.settings
        attribute_texts = ["", 'limited="true"', 'limited="false"']
        self.limited = attribute_texts[1:] if "autolimits" in self.settings else attribute_texts
        self.bodies = bodies
        self.joints = 0

    def text(self) -> str:
        children: dict[int, list[int]] = {k: [] for k in range(-1, self.bodies)}
        for k in range(self.bodies):
            children[int(self.random.integers(-1, k)) if k else -1].append(k)
        tree = "".join(self.body(k, children) for k in children[-1])
        defaults = (
            '<default><joint damping="0.4" armature="0.02"/><geom density="700"/>'
            '<default class="arm"><joint axis="0 1 0" armature="0.1"/><geom type="box" size="0.1 0.2 0.3"/>'
            '<default class="slider"><joint type="slide" axis="1 1 0"/></default></default></default>'
        )
        gravity = words(self.random.normal(size=3) * 5)
        return (
            f'<mujoco model="random"><compiler {self.settings}/><option gravity="{gravity}"/>{defaults}'
            f"<worldbody>{tree}</worldbody></mujoco>"
        )

    def body(self, k: int, children: dict[int, list[int]]) -> str:
        random = self.random
        default_class = random.choice(["", 'childclass="arm"', 'childclass="slider"'])
        joints = "".join(self.joint() for _ in range(int(random.choice([0, 1, 1, 2, 3]))))
        inertial = self.inertial() if random.random() < 0.6 else ""
        geoms = "".join(self.geom() for _ in range(int(random.integers(1, 3))))
        if random.random() < 0.3:
            geoms = f"<frame {self.pose()}>{geoms}<frame {self.pose()}>{self.geom()}</frame></frame>"
        inner = "".join(self.body(child, children) for child in children[k])
        if random.random() < 0.3:
            inner = f"<frame {self.pose()}>{inner}</frame>"
        return f'<body name="b{k}" {default_class} {self.pose()}>{joints}{inertial}{geoms}{inner}</body>'

    def angle(self, value: float) -> float:
        return value if self.in_radian else float(np.degrees(value))

    def pose(self) -> str:
        random = self.random
        angles = [self.angle(value) for value in random.uniform(-3, 3, 3)]
        orientations = (
            "",
            f'quat="{words(random.normal(size=4))}"',
            f'axisangle="{words([*random.normal(size=3), angles[0]])}"',
            f'euler="{words(angles)}"',
            f'xyaxes="{words(random.normal(size=6))}"',
            f'zaxis="{words(random.normal(size=3))}"',
            'zaxis="0 0 -2"',
        )
        return f'pos="{words(random.normal(size=3))}" {orientations[int(random.integers(len(orientations)))]}'

    def joint(self) -> str:
        random = self.random
        self.joints += 1
        attributes = [f'name="j{self.joints}"']
        choice = random.random()
        if choice < 0.25:
            attributes.append('type="slide"')
        elif choice < 0.5:
            attributes.append('type="hinge"')
        elif choice < 0.6:
            attributes.append('class="slider"')
        if random.random() < 0.7:
            attributes.append(f'axis="{words(random.normal(size=3))}"')
        if random.random() < 0.6:
            attributes.append(f'pos="{words(random.normal(size=3))}"')
        if random.random() < 0.4:
            attributes.append(f'ref="{random.uniform(-1, 1)}"')
        if random.random() < 0.5:
            low = random.uniform(-2, 0)
            limited = random.choice(self.limited)
            attributes.append(f'range="{low} {low + random.uniform(0.1, 2)}" {limited}')
        return f"<joint {' '.join(attributes)}/>"

    def inertial(self) -> str:
        random = self.random
        mass = f'mass="{random.uniform(0.2, 3)}"'
        if random.random() < 0.4:
            a = random.normal(size=(3, 3))
            # A covariance gives an inertia that obeys the triangle inequality.
            covariance = a @ a.T + 0.1 * np.eye(3)
            full = np.trace(covariance) * np.eye(3) - covariance
            entries = [full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2]]
            return f'<inertial pos="{words(random.normal(size=3))}" {mass} fullinertia="{words(entries)}"/>'
        moments = random.uniform(1.0, 1.9, 3)
        return f'<inertial {self.pose()} {mass} diaginertia="{words(moments)}"/>'

    def geom(self) -> str:
        random = self.random
        kind = str(random.choice([*SHAPES, "class"]))
        if kind == "class":
            return f'<geom class="arm" {self.pose()}/>'
        size = random.uniform(0.1, 0.5, SHAPES[kind])
        mass = random.choice(
            ["", f'mass="{random.uniform(0.1, 2)}"', f'density="{random.uniform(100, 900)}"']
        )
        group = random.choice(["", 'group="2"', 'group="4"'])
        if kind in ("capsule", "cylinder", "box", "ellipsoid") and random.random() < 0.4:
            place = f'fromto="{words(random.normal(size=6))}"'
            size = size[:1]
        else:
            place = self.pose()
        return f'<geom type="{kind}" size="{words(size)}" {place} {mass} {group}/>'
