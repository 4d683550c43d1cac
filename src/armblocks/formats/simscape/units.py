"""Units of mass and length, by the names that CAD exports use."""

from __future__ import annotations

from collections.abc import Mapping

_POUND = 0.45359237

MASSES: Mapping[str, float] = {
    "kilogram": 1.0,
    "kg": 1.0,
    "gram": 1e-3,
    "g": 1e-3,
    "milligram": 1e-6,
    "mg": 1e-6,
    "tonne": 1e3,
    "t": 1e3,
    "pound": _POUND,
    "poundmass": _POUND,
    "lbm": _POUND,
    "ounce": _POUND / 16,
    "slug": 14.593902937206364,
}
"""Kilograms per unit."""
LENGTHS: Mapping[str, float] = {
    "meter": 1.0,
    "metre": 1.0,
    "m": 1.0,
    "centimeter": 1e-2,
    "cm": 1e-2,
    "millimeter": 1e-3,
    "mm": 1e-3,
    "micrometer": 1e-6,
    "um": 1e-6,
    "kilometer": 1e3,
    "km": 1e3,
    "inch": 0.0254,
    "in": 0.0254,
    "foot": 0.3048,
    "ft": 0.3048,
}
"""Metres per unit."""
