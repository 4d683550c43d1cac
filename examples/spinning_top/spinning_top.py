"""A spinning top: steady precession and nutation, compared with their closed forms.

    python spinning_top.py OUT [--film]

simulates three motions of one top and writes a report of each into the folder OUT (``slow/report.html``,
``fast/report.html``, ``released/report.html``), and with ``--film`` the video ``top.mp4`` (extra ``film``):

- ``slow`` and ``fast``: the two steady precessions. The tilt θ is constant and the axis rotates about the
  vertical at a rate Ω, which satisfies A cos(θ) Ω² - C s Ω + m g l = 0. Here s is the spin about the axis;
  the moments of inertia are A (perpendicular to the axis, about the tip) and C (about the axis).
- ``released``: the spinning top is released at rest. Its axis oscillates (nutation): cos(θ) is an elliptic
  function of the time (E. T. Whittaker, A Treatise on the Analytical Dynamics, section 72).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.special import ellipj, ellipk

import armblocks as ab
from armblocks.blocks import Constant, Fkine, ForwardDynamics, Scope, T2xyz, XYGraph
from armblocks.robot.shapes import Cylinder, Housing, Material
from armblocks.spatial import transl

MASS, LENGTH = 1.0, 0.1  # kg, m from the tip to the centre of mass
ACROSS, AXIAL = 0.002, 0.001  # kg m2, about the centre of mass
TILT, SPIN = 0.5, 300.0  # rad from the vertical, rad/s about the axis
GRAVITY = 9.81  # m/s2
STOP_TIME = 4.0  # s


def top() -> ab.Robot:
    """The top on its tip; the tool is on the axis at the height of the centre of mass."""
    cone = Housing(start=(0.001, 0.001), end=(0.06, 0.06), length=LENGTH, roundness=1.0)
    stem_place = transl(0, 0, 1.3 * LENGTH).matrix
    stem = Cylinder(radius=0.008, length=0.6 * LENGTH, material=Material.FLANGE, pose=stem_place)
    body = ab.Link(
        name="top",
        joint=ab.Spherical(),
        mass=MASS,
        centre_of_mass=(0, 0, LENGTH),
        inertia=(ACROSS, ACROSS, AXIAL),
        geometry=(cone, stem),
    )
    return ab.Robot(name="Spinning top", links=(body,), tool=transl(0, 0, LENGTH), gravity=(0, 0, -GRAVITY))


def steady_rates() -> tuple[float, float]:
    """The slow and the fast rate of precession, rad/s."""
    across = ACROSS + MASS * LENGTH**2
    roots = np.roots([across * np.cos(TILT), -AXIAL * SPIN, MASS * GRAVITY * LENGTH])
    slow, fast = sorted(roots.real.tolist())
    return slow, fast


def released_height(t: np.ndarray) -> np.ndarray:
    """The height of the centre of mass (N,) m of the released top.

    u = cos(θ) satisfies u'^2 = k (u0 - u) (u - u1) (u2 - u), with k = 2 m g l / A.
    """
    across = ACROSS + MASS * LENGTH**2
    k, b = 2 * MASS * GRAVITY * LENGTH / across, (AXIAL * SPIN / across) ** 2
    u0 = np.cos(TILT)
    u1, u2 = sorted(np.roots([k, -b, b * u0 - k]).real.tolist())
    modulus = (u0 - u1) / (u2 - u1)
    sn = ellipj(np.sqrt(k * (u2 - u1)) / 2 * t + ellipk(modulus), modulus)[0]
    return LENGTH * (u1 + (u0 - u1) * sn**2)


def diagram(rate: float) -> ab.Diagram:
    """The top with its axis turning about the vertical at ``rate`` (rad/s) at the start."""
    robot = top()
    # The axis leans to -y; the angular velocity is in the axes of the body.
    q0 = (np.cos(TILT / 2), np.sin(TILT / 2), 0, 0)
    qd0 = (0, rate * np.sin(TILT), SPIN)
    settings = ab.SimulationOptions(stop_time=STOP_TIME, sample_time=0.005, rtol=1e-9, atol=1e-11)
    builder = ab.DiagramBuilder("spinning_top", settings=settings)
    free = builder.add("no torque", Constant(value=(0, 0, 0)))
    plant = builder.add("top", ForwardDynamics(robot=robot, q0=q0, qd0=qd0), free)
    centre = builder.add("centre", T2xyz(), builder.add("pose", Fkine(robot=robot), plant["q"]))
    for axis in "xyz":
        builder.name_signal(centre[axis], axis)
    builder.add("Seen from above", XYGraph(), centre["x"], centre["y"])
    builder.add("Height", Scope(), centre["z"])
    return builder.build()


def deviation(rate: float, result: ab.SimulationResult) -> float:
    """The largest deviation (m) of the centre of mass from the closed form, which it also prints."""
    centre = np.column_stack([result[f"centre/{axis}"] for axis in "xyz"])
    t, radius = result.time, LENGTH * np.sin(TILT)
    if rate:
        circle = [radius * np.sin(rate * t), -radius * np.cos(rate * t), 0 * t + LENGTH * np.cos(TILT)]
        largest = float(np.abs(centre - np.column_stack(circle)).max())
        text = f"precession {rate:.4f} rad/s"
    else:
        largest = float(np.abs(centre[:, 2] - released_height(t)).max())
        text = f"height {1e3 * centre[:, 2].min():.2f} to {1e3 * centre[:, 2].max():.2f} mm"
    print(f"{text}, largest deviation {largest:.1e} m")
    return largest


def main(out: Path, *, film: bool = False) -> None:
    """Simulate the three motions, and write their reports and the film."""
    slow, fast = steady_rates()
    for name, rate in (("slow", slow), ("fast", fast), ("released", 0.0)):
        model = diagram(rate)
        result = ab.simulate(model)
        deviation(rate, result)
        ab.write_report(out / name, model, result)
        if film and not rate:
            ab.write_film(out / "top.mp4", model, result)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "top_results"), film="--film" in sys.argv)
