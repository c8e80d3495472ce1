"""Elastic ball between two rigid frictionless planes, against Hertz's law. Needs NumPy: python ball_between_planes.py

Linear elasticity of the sphere (R = E = 1). Surface traction and displacement of degree n are linked by the two regular solutions of
Navier's equation (Love, A Treatise on the Mathematical Theory of Elasticity, article 172), with phi = r^n P_n(cos t), q = 1/(1 - 2 nu):

    u = grad phi                and     u = r^2 grad phi + c x phi,     c = -(4n + 2 + 2nq)/(2 + q(n + 3))

Both caps carry a vertical pressure p per area at rest, constant on rings. Contact: cos t + u_z <= 1 - depth, p >= 0, p = 0 where open; in the mean
over each ring.
"""

import numpy as np

POISSON = 0.45


def compliance(n, nu):
    """Radial and tangential displacement per radial and tangential traction of degree n."""
    mu = 1 / (2 * (1 + nu))
    lame = 2 * mu * nu / (1 - 2 * nu)
    q = 1 / (1 - 2 * nu)
    c = -(4 * n + 2 + 2 * n * q) / (2 + q * (n + 3))
    radial = lame * (2 * n + c * (n + 3)) + 2 * mu * (n + c) * (n + 1)
    if n == 0:
        return np.array([[c / radial, 0], [0, 0]])
    displacement = np.array([[n, n + c], [1, 1]])
    traction = np.array([[2 * mu * n * (n - 1), radial], [2 * mu * (n - 1), mu * (2 * n + c)]])
    return displacement @ np.linalg.inv(traction)


def ring_compliance(edges, nu, degrees):
    """Inward vertical displacement, integrated over each ring, per unit pressure on each ring of both caps."""
    x = np.cos(edges)
    legendre = np.empty((degrees + 3, len(x)))
    legendre[0], legendre[1] = 1, x
    for n in range(1, degrees + 2):
        legendre[n + 1] = ((2 * n + 1) * x * legendre[n] - n * legendre[n - 1]) / (n + 1)
    integral = np.empty((degrees + 2, len(x)))
    integral[0] = x
    for n in range(1, degrees + 2):
        integral[n] = (legendre[n + 1] - legendre[n - 1]) / (2 * n + 1)
    over = integral[:, :-1] - integral[:, 1:]
    matrix = np.zeros((len(x) - 1, len(x) - 1))
    for n in range(0, degrees + 1, 2):
        cosine = ((n + 1) * over[n + 1] + (n * over[n - 1] if n else 0)) / (2 * n + 1)
        sine = n * (n + 1) / (2 * n + 1) * (over[n - 1] - over[n + 1]) if n else 0 * cosine
        load = np.vstack([-(2 * n + 1) * cosine, -(over[n - 1] - over[n + 1]) if n else 0 * cosine])
        moved = compliance(n, nu) @ load
        matrix -= np.outer(cosine, moved[0]) + np.outer(sine, moved[1])
    return matrix


def force(depth, nu, rings):
    """Force of each plane over E R^2 at a depth over R."""
    edges = np.linspace(0, 1.35 * np.sqrt(depth), rings + 1)
    matrix = ring_compliance(edges, nu, int(12 / edges[1]))
    x = np.cos(edges)
    area = x[:-1] - x[1:]
    room = (depth - 1 + (x[:-1] + x[1:]) / 2) * area
    active = room > 0
    while True:
        pressure = np.zeros(rings)
        pressure[active] = np.linalg.solve(matrix[np.ix_(active, active)], room[active])
        pulling = active & (pressure <= 0)
        if not pulling.any():
            return 2 * np.pi * (pressure * area).sum()
        active &= ~pulling


def check(nu):
    """Stress in the centre of a ball that opposite forces P press at its poles, over P/(pi R^2): known in closed form (Sternberg & Rosenthal 1952)."""
    mu = 1 / (2 * (1 + nu))
    lame = 2 * mu * nu / (1 - 2 * nu)
    c = -(10 + 4 / (1 - 2 * nu)) / (2 + 5 / (1 - 2 * nu))
    traction = np.array([[4 * mu, lame * (4 + 5 * c) + 6 * mu * (2 + c)], [2 * mu, mu * (4 + c)]])
    strain = np.linalg.solve(traction, [-2.5, 0])[0]
    assert np.allclose(-0.5 + 4 * mu * strain, -(42 + 15 * nu) / (14 + 10 * nu))
    assert np.allclose(-0.5 - 2 * mu * strain, 21 / (28 + 20 * nu))
    # Betti's theorem, and the half-space for short waves.
    pair = compliance(4, nu)
    assert np.allclose(pair[0, 1], 20 * pair[1, 0])
    assert np.allclose(4000 * compliance(4000, nu)[0, 0], 2 * (1 - nu**2), rtol=1e-3)


if __name__ == "__main__":
    check(POISSON)
    check(0.3)
    roots = np.linspace(0.03, 0.26, 12)
    hertz = 4 / 3 / (1 - POISSON**2) * roots**3
    for rings in (60, 100):
        excess = np.array([force(s * s, POISSON, rings) for s in roots]) / hertz - 1
        powers = np.vstack([roots, roots**2]).T
        fit = np.linalg.lstsq(powers, excess, rcond=None)[0]
        print(f"{rings} rings: 1 + {fit[0]:.4f} s + {fit[1]:.4f} s^2 within {np.abs(powers @ fit - excess).max():.1e}")
