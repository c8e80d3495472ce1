"""Shapes of MuJoCo's geoms as palpate's obstacles. Imported by palpate.mujoco only."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Union

import mujoco  # type: ignore[import-untyped, import-not-found, unused-ignore]
import numpy as np

from palpate._errors import InputError
from palpate._poses import points_in_world, quaternion_product
from palpate._scene import Obstacle, Plane

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from palpate._poses import Array

    Mesh = tuple[Array, NDArray[np.int_]]

#: Sides of a cylinder: its surface is off by ±0.05 % of the radius.
_SIDES = 48
#: Subdivisions of the icosahedron that an ellipsoid is made of, 1280 triangles: off by ±0.4 % of the radii at most.
_SUBDIVISIONS = 3
#: Turn of the y axis, about which palpate's capsules are, to z.
_Y_TO_Z = np.array([np.sqrt(0.5), np.sqrt(0.5), 0, 0])

_TYPE = mujoco.mjtGeom
#: Types of geoms that can press a soft body.
CAN_PRESS = (
    _TYPE.mjGEOM_PLANE,
    _TYPE.mjGEOM_SPHERE,
    _TYPE.mjGEOM_BOX,
    _TYPE.mjGEOM_CAPSULE,
    _TYPE.mjGEOM_CYLINDER,
    _TYPE.mjGEOM_ELLIPSOID,
    _TYPE.mjGEOM_MESH,
)


def shape_of(model: Any, geom: int, friction: float | None, folder: str) -> Union[Obstacle, Plane]:
    """Obstacle or plane of a geom, in the frame of its body.

    Parameters
    ----------
    model : mujoco.MjModel
    geom : int
    friction : float or None
        Coefficient; None takes the geom's own, of sliding.
    folder : str
        Folder that meshes are written to.
    """
    pose = np.concatenate([model.geom_pos[geom], model.geom_quat[geom]])
    size = model.geom_size[geom]
    kind = _TYPE(int(model.geom_type[geom]))
    own = float(model.geom_friction[geom, 0]) if friction is None else float(friction)
    if kind == _TYPE.mjGEOM_PLANE:
        return Plane(normal=points_in_world(pose, np.array([0, 0, 1.0])) - pose[:3], point=pose[:3], friction=own)
    keys: dict[str, Any] = {"position": pose[:3], "orientation": pose[3:], "friction": own}
    if kind == _TYPE.mjGEOM_SPHERE:
        return Obstacle(sphere={"radius": float(size[0])}, **keys)
    if kind == _TYPE.mjGEOM_BOX:
        return Obstacle(box={"half_extents": size.copy()}, **keys)
    if kind == _TYPE.mjGEOM_CAPSULE:
        keys["orientation"] = quaternion_product(pose[3:], _Y_TO_Z)
        return Obstacle(capsule={"radius": float(size[0]), "half_length": float(size[1])}, **keys)
    if kind == _TYPE.mjGEOM_CYLINDER:
        mesh = cylinder(size[0], size[1])
    elif kind == _TYPE.mjGEOM_ELLIPSOID:
        mesh = ellipsoid(size)
    elif kind == _TYPE.mjGEOM_MESH:
        mesh = convex_hull(model, geom)
    else:
        raise InputError(
            f"geom {name_of(model, geom)} is of the type {kind.name}, expected a plane, sphere, box, capsule, cylinder, ellipsoid or mesh: "
            "leave it out of geoms"
        )
    path = os.path.join(folder, f"geom{geom}.obj")
    write_obj(path, mesh)
    return Obstacle(mesh={"file": path}, **keys)


def name_of(model: Any, geom: int) -> str:
    """Name of a geom in messages."""
    return model.geom(geom).name or f"{geom} of body {model.body(model.geom_bodyid[geom]).name}"


def cylinder(radius: float, half_length: float) -> Mesh:
    """Prism about z; its surface is as far outside the cylinder at edges as it is inside between them."""
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    radius = 2 * radius / (1 + np.cos(np.pi / _SIDES))
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    lift = np.array([0, 0, half_length])
    nodes = np.concatenate([ring - lift, ring + lift, [-lift, lift]])
    low = np.arange(_SIDES)
    next_low = np.roll(low, -1)
    high, next_high = low + _SIDES, next_low + _SIDES
    bottom, top = np.full(_SIDES, 2 * _SIDES), np.full(_SIDES, 2 * _SIDES + 1)
    faces = [(low, next_low, next_high), (low, next_high, high), (bottom, next_low, low), (top, high, next_high)]
    return nodes, np.concatenate([np.stack(face, axis=1) for face in faces])


def ellipsoid(radii: Array) -> Mesh:
    """Subdivided icosahedron, as far outside at its nodes as it is inside between them."""
    golden = (1 + np.sqrt(5)) / 2
    base = np.array([[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0]])
    nodes = [list(node) for turn in range(3) for node in np.roll(base, turn, axis=1)]
    unit = np.array(nodes)
    near = np.isclose(((unit[:, None] - unit) ** 2).sum(-1), 4)
    triples = [(a, b, c) for a in range(12) for b in range(a + 1, 12) for c in range(b + 1, 12) if near[a, b] and near[b, c] and near[a, c]]
    faces = [t if np.linalg.det(unit[list(t)]) > 0 else (t[0], t[2], t[1]) for t in triples]
    for _ in range(_SUBDIVISIONS):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:  # noqa: B023
                middles[key] = len(nodes)  # noqa: B023
                nodes.append([(nodes[a][axis] + nodes[b][axis]) / 2 for axis in range(3)])
            return middles[key]  # noqa: B023

        finer = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    points = np.array(nodes)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    triangles = np.array(faces)
    inner = np.linalg.norm(points[triangles].mean(axis=1), axis=1).min()
    return points * 2 / (1 + inner) * np.asarray(radii), triangles


def convex_hull(model: Any, geom: int) -> Mesh:
    """Convex hull of a mesh, which MuJoCo collides with, too."""
    mesh = int(model.geom_dataid[geom])
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]].astype(float)
    at = int(model.mesh_graphadr[mesh])
    if at < 0:
        raise InputError(f"geom {name_of(model, geom)}: its mesh has no convex hull, since nothing collides with it: leave it out of geoms")
    # numvert, numface, vert_edgeadr[numvert], vert_globalid[numvert], edge_localid[numvert + 3·numface], face_globalid[3·numface]
    graph = model.mesh_graph[at:]
    corners, count = int(graph[0]), int(graph[1])
    own = graph[2 + corners : 2 + 2 * corners]
    faces = graph[2 + 3 * corners + 3 * count :][: 3 * count].reshape(count, 3)
    local = np.full(len(vertices), -1)
    local[own] = np.arange(corners)
    return vertices[own], local[faces]


def write_obj(path: str, mesh: Mesh) -> None:
    """Write a mesh to the bit."""
    nodes, triangles = mesh
    with open(path, "w", encoding="ascii") as file:
        file.writelines("v {!r} {!r} {!r}\n".format(*node) for node in nodes.tolist())
        file.writelines("f {} {} {}\n".format(*triangle) for triangle in (triangles + 1).tolist())
