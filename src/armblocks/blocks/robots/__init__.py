"""Blocks of robot arms: kinematics, dynamics, trajectories, joint sensors, drives and controllers."""
