"""All branches of the inverse kinematics in closed form, for arms whose axes intersect or are parallel.

An arm is described by its axes in the world where all joint angles are zero (:mod:`.axes`), so that the
solution depends on the geometry and not on conventions. Every equation is one of three subproblems
(:mod:`.subproblems`).
"""
