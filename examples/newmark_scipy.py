#!/usr/bin/env python3
"""Columns of R[s] with SciPy: Newmark's average-acceleration rule, factored once.

    M·ü + C·u̇ + K·u = f,   C = α·M + β·K,   f a unit force that is constant over the first sample [N]

    A·v̄ = f − K·u + (2/h)·M·v,   A = 2/h·M + C + h/2·K,   u ← u + h·v̄,   v ← 2·v̄ − v

u [m] and v [m/s] are displacement and velocity, v̄ the mean velocity of the step h [s]. The body is the paper's cube
[`palpate record box:0.1x0.1x0.1/NxNxN --order 1 --method transient`]: linear tetrahedra, five a cell, consistent mass,
and the load balanced by rigid inertia, so that no rigid motion is in the columns. The error falls as h².

    python newmark_scipy.py --cells 12 --samples 1000 --columns 16
"""

import argparse
import json
import os
import time

# SuperLU's kernels are too small for threads: before NumPy comes in.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

# Fastest ordering and pivoting of SuperLU (see --try-options; other block sizes make no difference).
SYMMETRIC = dict(diag_pivot_thresh=0.0, options=dict(SymmetricMode=True))
FASTEST = dict(permc_spec="MMD_AT_PLUS_A", **SYMMETRIC)
TRIED = [
    dict(permc_spec=ordering, **mode) for ordering in ("COLAMD", "MMD_ATA", "MMD_AT_PLUS_A") for mode in ({}, SYMMETRIC)
]


def cube(size, cells):
    """Nodes [m] and tetrahedra: palpate's `box_mesh`, numbered alike."""
    n = cells + 1
    grid = np.arange(n)
    nodes = (np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), -1).reshape(-1, 3) / cells - 0.5) * size
    # Corners of a cell's five tetrahedra; odd cells are mirrored in x, which turns them inside out.
    split = np.array(
        [
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
            [(1, 1, 0), (0, 1, 0), (1, 0, 0), (1, 1, 1)],
            [(1, 0, 1), (1, 0, 0), (0, 0, 1), (1, 1, 1)],
            [(0, 1, 1), (0, 1, 0), (1, 1, 1), (0, 0, 1)],
            [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)],
        ]
    )
    mirrored = split[:, [0, 1, 3, 2]].copy()
    mirrored[..., 0] ^= 1
    cell = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), -1).reshape(-1, 1, 1, 3)
    at = cell + np.where(cell.sum(-1, keepdims=True) % 2, mirrored, split)
    return nodes, ((at[..., 0] * n + at[..., 1]) * n + at[..., 2]).reshape(-1, 4)


def assemble(nodes, tets, young, poisson, density):
    """K [N/m] and M [kg], consistent."""
    lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    edges = nodes[tets[:, 1:]] - nodes[tets[:, :1]]
    volume = np.linalg.det(edges) / 6
    # Gradients g of the barycentric coordinates [1/m].
    g = np.linalg.inv(edges).transpose(0, 2, 1)
    g = np.concatenate([-g.sum(1, keepdims=True), g], 1)
    # K_ij = V·(λ·g_i·g_jᵀ + μ·g_j·g_iᵀ + μ·(g_i·g_j)·1),   M_ij = ρV·(1 + δ_ij)/20
    outer = np.einsum("eia,ejb->eijab", g, g)
    inner = np.einsum("eia,eja,bc->eijbc", g, g, np.eye(3))
    k = volume[:, None, None, None, None] * (lame * outer + shear * (outer.swapaxes(3, 4) + inner))
    m = density * volume[:, None, None] / 20 * (1 + np.eye(4))
    rows, columns = np.repeat(tets, 4, 1).ravel(), np.tile(tets, 4).ravel()
    shape = (len(nodes), len(nodes))
    mass = sparse.coo_array((m.ravel(), (rows, columns)), shape=shape)
    a, b = np.divmod(np.arange(9), 3)
    dofs = lambda node, axis: (3 * node[:, None] + axis).ravel()
    stiffness = sparse.coo_array((k.ravel(), (dofs(rows, a), dofs(columns, b))), shape=(3 * len(nodes),) * 2)
    return stiffness.tocsc(), sparse.kron(mass, sparse.eye_array(3)).tocsr()


def balanced(loads, mass, nodes):
    """The loads less the part that moves the body as a whole: M-orthogonal to its six rigid modes."""
    turns = [np.cross(axis, nodes).ravel() for axis in np.eye(3)]
    rigid = np.column_stack([*np.tile(np.eye(3), (len(nodes), 1)).T, *turns])
    inertia = mass @ rigid
    return loads - inertia @ np.linalg.solve(rigid.T @ inertia, rigid.T @ loads)


def respond(factor, mass, loads, observed, a, c, h, samples, substeps, dtype):
    """Columns [load, sample, observed]; A = a·M + c·K. K·u and M·v are carried along: A·v̄ tells K·v̄."""
    responses = np.empty((samples, len(observed), loads.shape[1]), dtype)
    u = np.zeros_like(loads, order="F")
    stiffness_u, mass_v = np.zeros_like(u), np.zeros_like(u)
    for sample in range(samples):
        for _ in range(substeps):
            right = (2 / h) * mass_v - stiffness_u
            if sample == 0:
                right += loads
            v_mean = factor.solve(right)
            mass_v_mean = mass @ v_mean
            stiffness_u += (h / c) * (right - a * mass_v_mean)
            mass_v = 2 * mass_v_mean - mass_v
            u += h * v_mean
        responses[sample] = u[observed]
    return responses.transpose(2, 0, 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    option = parser.add_argument
    option("--cells", type=int, default=12, help="cells a side (12)")
    option("--size", type=float, default=0.1, help="side [m] (0.1)")
    option("--young", type=float, default=2000.0, help="Young's modulus [Pa] (2000)")
    option("--poisson", type=float, default=0.49, help="Poisson's ratio (0.49)")
    option("--density", type=float, default=110.0, help="density [kg/m³] (110)")
    option("--rayleigh", type=float, nargs=2, default=[2.0, 2e-4], metavar=("ALPHA", "BETA"), help="[1/s] [s] (2 2e-4)")
    option("--step", type=float, default=1e-3, help="time between samples, and how long the force is held [s] (0.001)")
    option("--samples", type=int, default=1000, help="samples a column (1000)")
    option("--substeps", type=int, default=1, help="integration steps a sample (1)")
    option("--columns", type=int, default=16, help="the first so many degrees of freedom of the surface (16)")
    option("--dtype", choices=["float32", "float64"], default="float32", help="numbers that are kept (float32)")
    option("--output", metavar="OUT.npy", help="write the columns [touchable, sample, observed] (m/N)")
    option("--try-options", action="store_true", help="time SuperLU's options and stop")
    arguments = parser.parse_args()

    start = time.perf_counter()
    nodes, tets = cube(arguments.size, arguments.cells)
    K, M = assemble(nodes, tets, arguments.young, arguments.poisson, arguments.density)
    surface = np.flatnonzero((abs(nodes) > 0.4999999 * arguments.size).any(1))
    observed = (3 * surface[:, None] + np.arange(3)).ravel()
    touchable = observed[: arguments.columns]
    unit = np.zeros((K.shape[0], len(touchable)))
    unit[touchable, np.arange(len(touchable))] = 1
    loads = np.asfortranarray(balanced(unit, M, nodes))

    # A = a·M + c·K
    h, (alpha, beta) = arguments.step / arguments.substeps, arguments.rayleigh
    a, c = 2 / h + alpha, beta + h / 2
    A = (a * M + c * K).tocsc()
    for tried in TRIED if arguments.try_options else []:
        began = time.perf_counter()
        factor = splu(A, **tried)
        factored = time.perf_counter()
        for _ in range(10):
            factor.solve(loads)
        solved = time.perf_counter()
        fill = factor.L.nnz + factor.U.nnz
        print(f"factor {factored - began:6.3f} s, solve {(solved - factored) / 10:7.4f} s, {fill:9} entries, {tried}")
    if arguments.try_options:
        return
    assembled = time.perf_counter()
    factor = splu(A, **FASTEST)
    factored = time.perf_counter()
    columns = respond(factor, M, loads, observed, a, c, h, arguments.samples, arguments.substeps, arguments.dtype)
    stepped = time.perf_counter()
    if arguments.output:
        np.save(arguments.output, columns)
    result = dict(
        seconds_total=time.perf_counter() - start,
        seconds_factor=factored - assembled,
        seconds_per_column=(stepped - factored) / len(touchable),
        columns=len(touchable),
        samples=arguments.samples,
        cells=arguments.cells,
    )
    print(json.dumps(result))


if __name__ == "__main__":
    main()
