"""What two materials make of a contact: a textbook version, apart from the package's, in SI."""

from __future__ import annotations


def effective_modulus(one: tuple[float, float], other: tuple[float, float]) -> float:
    """E* of two materials, each given by Young's modulus and Poisson's ratio."""
    return 1.0 / sum((1.0 - ratio**2) / modulus for modulus, ratio in (one, other))
