"""The diagram of the paper compared with Drake: the same signals, with native systems where available.

Drake: TrajectorySource, InverseDynamics and the filters are native systems. Forward kinematics is a Python
leaf system that calls MultibodyPlant, because Drake has no native one. The integrator is runge_kutta5 with
accuracy 1e-3 and steps of at most 10 ms. Torque and filtered derivative are logged every 10 ms. armblocks:
the shipped example with steps of 10 ms, all signals recorded. Its derivatives are exact, so it has no
filter states.
"""

from __future__ import annotations

import logging
import time

import numpy as np
from measure import Timing, in_turn
from urdf import to_urdf

import armblocks as ab


def drake_run() -> float:
    """Build Drake's diagram and return the wall time of AdvanceTo(10 s), in s."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.polynomial import Polynomial
    from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
    from pydrake.systems.controllers import InverseDynamics
    from pydrake.systems.framework import DiagramBuilder, LeafSystem
    from pydrake.systems.primitives import (
        Adder,
        Demultiplexer,
        Gain,
        Integrator,
        LogVectorOutput,
        TrajectorySource,
    )
    from pydrake.trajectories import PiecewisePolynomial

    robot = ab.load_robot("kr180").robot
    q0, qf, T, pole = np.zeros(4), np.array([3.14, 0, 1.57, 0]), 10.0, 50.0

    def plant() -> MultibodyPlant:
        result = MultibodyPlant(0.0)
        Parser(result).AddModelsFromString(to_urdf(robot), "urdf")
        result.WeldFrames(result.world_frame(), result.GetFrameByName("base"))
        for number, link in enumerate(robot.links, start=1):
            actuator = result.AddJointActuator(f"a{number}", result.GetJointByName(f"j{number}"))
            actuator.set_default_rotor_inertia(link.motor.inertia)
            actuator.set_default_gear_ratio(link.motor.gear_ratio)
        result.Finalize()
        return result

    class ToolPosition(LeafSystem):
        def __init__(self, arm: MultibodyPlant) -> None:
            LeafSystem.__init__(self)
            self.arm, self.state, self.tip = arm, arm.CreateDefaultContext(), arm.GetFrameByName("tip")
            self.q = self.DeclareVectorInputPort("q", 4)
            self.DeclareVectorOutputPort("xyz", 3, self.evaluate)

        def evaluate(self, context, output) -> None:
            self.arm.SetPositions(self.state, self.q.Eval(context))
            output.SetFromVector(self.tip.CalcPoseInWorld(self.state).translation())

    coefficients = [
        [Polynomial([a, 0, 0, 10 * d / T**3, -15 * d / T**4, 6 * d / T**5])] for a, d in zip(q0, qf - q0)
    ]
    path = PiecewisePolynomial([np.array(coefficients)], [0.0, T])
    builder, arm = DiagramBuilder(), plant()
    tool = builder.AddSystem(ToolPosition(arm))
    state = builder.AddSystem(TrajectorySource(path, 1))
    acceleration = builder.AddSystem(TrajectorySource(path.derivative(2), 0))
    inverse = builder.AddSystem(InverseDynamics(arm, InverseDynamics.InverseDynamicsMode.kInverseDynamics))
    split = builder.AddSystem(Demultiplexer(8, 4))
    builder.Connect(state.get_output_port(), inverse.get_input_port_estimated_state())
    builder.Connect(acceleration.get_output_port(), inverse.get_input_port_desired_acceleration())
    builder.Connect(state.get_output_port(), split.get_input_port())
    builder.Connect(split.get_output_port(0), tool.get_input_port())
    memory, total = builder.AddSystem(Integrator(3)), builder.AddSystem(Adder(2, 3))
    minus, gain = builder.AddSystem(Gain(-1.0, 3)), builder.AddSystem(Gain(pole, 3))
    builder.Connect(tool.get_output_port(), total.get_input_port(0))
    builder.Connect(memory.get_output_port(), minus.get_input_port())
    builder.Connect(minus.get_output_port(), total.get_input_port(1))
    builder.Connect(total.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), memory.get_input_port())
    LogVectorOutput(inverse.get_output_port_generalized_force(), builder, 0.01)
    LogVectorOutput(gain.get_output_port(), builder, 0.01)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    start = arm.CreateDefaultContext()
    arm.SetPositions(start, q0)
    position = arm.GetFrameByName("tip").CalcPoseInWorld(start).translation()
    memory.set_integral_value(memory.GetMyMutableContextFromRoot(context), position)
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta5", 0.01)
    simulator.get_mutable_integrator().set_target_accuracy(1e-3)
    simulator.Initialize()
    start_time = time.perf_counter()
    simulator.AdvanceTo(T)
    return time.perf_counter() - start_time


def compare(repeats: int) -> tuple[Timing, Timing]:
    """Wall times of the 10 s run without compilation: Drake, then armblocks through ``simulate``."""
    diagram = ab.load_diagram("kr180model")
    ab.simulate(diagram)
    theirs: list[float] = []
    ours: list[float] = []
    for _ in range(repeats):
        theirs.append(drake_run())
        [timing] = in_turn([lambda: ab.simulate(diagram)], 1)
        ours += timing.turns
    return Timing(tuple(theirs)), Timing(tuple(ours))
