"""Motor friction at the joint side of the gear, by release of the Robotics Toolbox for MATLAB."""

from __future__ import annotations

from enum import Enum


class FrictionModel(Enum):
    """The friction formula of the joint torque, ``tau = rigid body + G^2 Jm qdd + friction(qd)``.

    ``G`` is the gear ratio; its sign is the direction of the motor. ``B`` is the viscous and ``Tc`` the
    Coulomb friction, both at the motor. ``Tc`` is ``Tc+`` if the *joint* speed ``qd`` is positive, ``Tc-`` (a
    negative number) if it is negative, and 0 at rest.
    """

    SQUARED_GEAR = "squared-gear"
    """``G^2 B qd + |G| Tc``: releases 9.5 to 10, the physically correct formula."""
    ABSOLUTE_GEAR = "absolute-gear"
    """``|G| (B qd + Tc)``: releases 9.0 to 9.4."""
    SIGNED_GEAR = "signed-gear"
    """``G (B qd + Tc)``: releases 7 and 8. If G is negative, friction drives the joint."""
    RELEASE_6 = "release-6"
    """``G^2 (B qd + Tc)``: release 6."""

    def factors(self, gear_ratio: float) -> tuple[float, float]:
        """The factors of ``B qd`` and of ``Tc`` in the formula."""
        G = gear_ratio
        match self:
            case FrictionModel.SQUARED_GEAR:
                return G * G, abs(G)
            case FrictionModel.ABSOLUTE_GEAR:
                return abs(G), abs(G)
            case FrictionModel.SIGNED_GEAR:
                return G, G
            case FrictionModel.RELEASE_6:
                return G * G, G * G
