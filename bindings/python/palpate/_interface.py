"""Quasi-Newton solution of an interface problem: the wrenches x that return as x from a step that they move.

r(x) = F(x) + d − x = 0, with F the wrenches that contacts answer with and d what is owed from the last step. F is linear but where contacts open or
close. Broyden's update keeps an estimate of the inverse of dr/dx, which lasts from step to step: H += (Δx − H·Δr)·Δxᵀ·H / (Δxᵀ·H·Δr).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from palpate._poses import Array

#: Least share of a secant's denominator that an update is made with.
_CONDITION = 1e-8


class Interface:
    """Estimate of the inverse Jacobian, and the iteration.

    Parameters
    ----------
    size : int
        Number of unknowns.
    iterations : int
        Most evaluations in a step.
    tolerance : float
        Residual, as a share of the wrenches, at which the iteration ends.
    """

    def __init__(self, size: int, iterations: int, tolerance: float) -> None:
        self.size, self.iterations, self.tolerance = size, iterations, tolerance
        self.forget()

    def forget(self) -> None:
        """Begin anew, with relaxation: dr/dx = −1."""
        self.inverse = -np.eye(self.size)

    def solve(self, residual: Callable[[Array], tuple[Array, float]], x: Array) -> tuple[int, bool]:
        """Find x with a small residual; the last evaluation is at the x that is kept.

        Parameters
        ----------
        residual : callable
            Residual at x, and the size of the wrenches there.
        x : (size,) array
            First guess.

        Returns
        -------
        evaluations, is_converged
        """
        r, size = residual(x)
        best, best_norm = (x, r), self._norm(r)
        count = 1
        at_best = True
        while best_norm > self.tolerance * size and count < self.iterations:
            x = best[0] - self.inverse @ best[1]
            r, size = residual(x)
            count += 1
            self._update(x - best[0], r - best[1])
            norm = self._norm(r)
            at_best = norm < best_norm
            if at_best:
                best, best_norm = (x, r), norm
        if not at_best:
            r, size = residual(best[0])
            count += 1
        return count, bool(best_norm <= self.tolerance * size)

    @staticmethod
    def _norm(r: Array) -> float:
        return float(np.sqrt(r @ r))

    def _update(self, dx: Array, dr: Array) -> None:
        step = self.inverse @ dr
        bottom = float(dx @ step)
        if abs(bottom) > _CONDITION * self._norm(dx) * self._norm(step):
            self.inverse += np.outer(dx - step, dx @ self.inverse) / bottom
