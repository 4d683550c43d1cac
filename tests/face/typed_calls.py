"""Calls of the public functions for type checkers: pyright checks this file, and no test runs it.

A line with ``ignore`` has an error that pyright must report. An ``ignore`` without an error is itself an
error.
"""

# pyright: strict, reportUnnecessaryTypeIgnoreComment=true

import numpy as np

import armblocks as ab

arm = ab.load_robot("puma560")
q = np.zeros(6)
arm.fkine(q=q)
arm.rne(q, qd=q, qdd=q, payload=2.0)
arm.accel(q, q, tau=q)
arm.accel(q, q, qdd=q)  # pyright: ignore[reportCallIssue]

ab.simulate("kr180model", stop_time=1.0, step=None)
ab.simulate("kr180model", stop_tme=1.0)  # pyright: ignore[reportCallIssue]
ab.simulate("kr180model", stop_time="1")  # pyright: ignore[reportArgumentType]
ab.begin("kr180model", solver="rk4")
ab.begin("kr180model", slover="rk4")  # pyright: ignore[reportCallIssue]
ab.linearize("van_der_pol_pid", rtol=1e-9)
ab.linearize("van_der_pol_pid", rtoll=1e-9)  # pyright: ignore[reportCallIssue]
ab.frequency_response("van_der_pol_pid", "u", "y", q, rtoll=1e-9)  # pyright: ignore[reportCallIssue]
ab.trim("van_der_pol_pid", max_step=0.1)
ab.trim("van_der_pol_pid", max_stp=0.1)  # pyright: ignore[reportCallIssue]
ab.sensitivity("van_der_pol_pid", "PID.P", "PID", atol=1e-9)
ab.sensitivity("van_der_pol_pid", "PID.P", "PID", atoll=1e-9)  # pyright: ignore[reportCallIssue]

ab.blocks.Fkine(robot=arm).robot.nofriction()
ab.blocks.Fkine(robot=arm.robot).with_parameters(robot=arm)
ab.blocks.Fkine(robot=3)  # pyright: ignore[reportArgumentType]
