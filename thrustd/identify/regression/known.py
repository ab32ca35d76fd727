"""What earlier records said of a model, as the prior of the next ones.

Friction and its growth with the deformation act as a product: a Gaussian in these numbers is right where the search
ended, and far off where friction gives up a half and grows by twice as much instead. In the forces that they stand for,
with a growth times all friction, squares of the records are nearly quadratic: there the Gaussian stands.
"""

from dataclasses import dataclass

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.regression.shape import Shape


@dataclass(frozen=True, slots=True)
class Known:
    """A Gaussian in the forces of a shape's numbers: mean (n,), precision (n, n)."""

    shape: Shape
    mean: Floats
    precision: Floats

    @classmethod
    def of(cls, shape: Shape, vector: Floats, information: Floats) -> "Known":
        """Numbers with this mean and information (n, n) there."""
        back = np.linalg.inv(_slopes(shape, vector))
        return cls(shape, forces(shape, vector), back.T @ information @ back)

    def cost(self, vector: Floats) -> float:
        """Minus twice its logarithm, but for a constant."""
        away = forces(self.shape, vector) - self.mean
        return float(away @ self.precision @ away)

    def information(self, vector: Floats) -> Floats:
        """Of the numbers (n, n), there."""
        turned = _slopes(self.shape, vector)
        found: Floats = turned.T @ self.precision @ turned
        return found

    def downhill(self, vector: Floats) -> Floats:
        """Minus half the gradient of the cost (n,)."""
        found: Floats = _slopes(self.shape, vector).T @ self.precision @ (self.mean - forces(self.shape, vector))
        return found


def forces(shape: Shape, vector: Floats) -> Floats:
    """With growth times the whole friction."""
    where, found = shape.parts(), vector.copy()
    found[where["growth"]] *= vector[where["stops"]].sum()
    return found


def _slopes(shape: Shape, vector: Floats) -> Floats:
    """Derivatives (n, n) of these forces."""
    where, found = shape.parts(), np.eye(shape.n)
    growth, stops = where["growth"], where["stops"]
    found[growth, growth] *= vector[stops].sum()
    found[growth, stops] = vector[growth, None]
    return found
