"""Quasi-Newton solution of an interface problem: the wrenches x that return as x from a step that they move.

r(x) = F(x) + d − x = 0, with F the wrenches that contacts answer with and d what is owed from the last step. With the differences V of residuals and W of
answers y = F + d between trials, of this step and some before it: x' = y + W·c with c the least squares of V·c + r = 0 (interface quasi-Newton with
least squares, IQN-ILS; Degroote, Bathe and Vierendeels, Computers & Structures 87, 2009).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from palpate._poses import Array

#: Least share of a difference that must be new beside the later ones.
_NEW = 0.03
#: Differences that are kept from earlier steps, at most.
_KEPT = 12
#: Trials after which differences of earlier steps are dropped: contacts have changed.
_PATIENCE = 6


class Interface:
    """Differences between trials, and the iteration.

    Parameters
    ----------
    iterations : int
        Most evaluations in a step.
    tolerance : float
        Residual, as a share of the wrenches, at which the iteration ends.
    """

    def __init__(self, iterations: int, tolerance: float) -> None:
        self.iterations, self.tolerance = iterations, tolerance
        #: Residual of the last step, as a share of the wrenches.
        self.residual = 0.0
        self.forget()

    def forget(self) -> None:
        """Begin anew, with relaxation."""
        #: Differences of residuals and of answers, the latest first.
        self._differences: list[tuple[Array, Array]] = []

    def solve(self, residual: Callable[[Array], tuple[Array, float]], x: Array) -> tuple[int, bool]:
        """Find x with a small residual; the last evaluation is at the x that is kept.

        Parameters
        ----------
        residual : callable
            Residual at x, and the size of the wrenches there.
        x : array
            First guess.

        Returns
        -------
        evaluations, is_converged
        """
        r, size = residual(x)
        best, best_norm = x, _norm(r)
        count, at_best = 1, True
        while best_norm > self.tolerance * size and count < self.iterations:
            if count == _PATIENCE:
                del self._differences[count - 1 :]
            x_next = x + r + self._correction(r)
            r_next, size = residual(x_next)
            count += 1
            dr = r_next - r
            self._differences.insert(0, (dr, x_next - x + dr))
            x, r = x_next, r_next
            at_best = _norm(r) < best_norm
            if at_best:
                best, best_norm = x, _norm(r)
        if not at_best:
            r, size = residual(best)
            count += 1
        del self._differences[_KEPT:]
        self.residual = best_norm / size
        return count, bool(best_norm <= self.tolerance * size)

    def _correction(self, r: Array) -> Array:
        """W·c with c the least squares of V·c + r = 0, by Gram–Schmidt over the differences that are new, the latest first."""
        basis: list[Array] = []
        triangle: list[list[float]] = []
        answers: list[Array] = []
        for dr, dy in self._differences:
            rest, above = dr, []
            for unit in basis:
                above.append(float(unit @ rest))
                rest = rest - above[-1] * unit
            left = _norm(rest)
            if left > _NEW * _norm(dr) > 0:
                basis.append(rest / left)
                triangle.append([*above, left])
                answers.append(dy)
        c = [-float(unit @ r) for unit in basis]
        for column in reversed(range(len(c))):
            c[column] /= triangle[column][column]
            for row in range(column):
                c[row] -= triangle[column][row] * c[column]
        return sum((share * dy for share, dy in zip(c, answers)), np.zeros_like(r))


def _norm(r: Array) -> float:
    return float(np.sqrt(r @ r))
