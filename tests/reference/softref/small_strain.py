"""Linear small-strain pad stiffness of the cube, sticking pads by samples with coverage: no gravity, no table."""

import numpy as np
import scipy.sparse as sp

from . import contact, symmetry
from .element import full_stiffness
from .measure import deformation
from .mesh import cube, voxel_mesh
from .statics import Elastic, factor

# Converged stiffness (N/m) and D (%/mm) by pad (mm) and offset along one axis (mm): the outside reference for the centred
# 22 mm pad, rows/truth.jsonl (finest, good to 0.4 %) for the others.
TRUTH = {
    (22.0, 0.0): (620.0, 0.212),
    (18.0, 0.0): (483.6, 0.1878),
    (20.0, 0.0): (551.6, 0.1997),
    (24.0, 0.0): (696.4, 0.2256),
    (22.0, 4.1667): (615.9, 0.2089),
}


def row(resolution, pad=0.022, offset=(0.0, 0.0), near_rigid=False, edge=0.05, youngs=3e4, poisson=0.4):
    """Pad force and D for 1 mm of closing; `near_rigid` replaces softvt's contact modulus by 1e12 Pa/m."""
    body = cube(edge)
    mesh = voxel_mesh(body, resolution)
    mirrors = {0: 0.0} | {a: c for a, c, o in ((1, 0.0, offset[0]), (2, edge / 2, offset[1])) if o == 0}
    whole = Elastic(mesh, youngs, poisson, mirrors)
    n = len(whole.reps)
    k = whole.reduce(np.broadcast_to(full_stiffness(mesh.edge, youngs, poisson), (n, 24, 24)))
    points, area, cell = body.samples(0.75e-3)
    reps, share = symmetry.orbits(points, mirrors)
    left = points[reps, 0] < -edge / 2 + 1e-9
    reps, share = reps[left], share[left]
    face = contact.Face(0, 1.0, 0.0, (offset[0], edge / 2 + offset[1]), pad / 2)
    cover, _ = face.coverage(points[reps][:, 1:], cell[reps])
    reps, share, cover = reps[cover > 0], share[cover > 0], cover[cover > 0]
    c = 1e12 if near_rigid else contact.modulus(youngs, mesh.edge)
    spring = c * area[reps] * cover * share
    element, w = mesh.embed(points[reps])
    at = np.repeat(np.arange(len(reps)), 8)
    embed = sp.csr_matrix((w.ravel(), (at, mesh.elements[element].ravel())), (len(reps), len(mesh.nodes)))
    j = (sp.kron(embed, sp.eye(3), format="csr") @ whole.t).tocsr()
    diagonal = (spring[:, None] * [1.0, contact.TANGENTIAL, contact.TANGENTIAL]).ravel()
    total = (k + j.T @ sp.diags(diagonal) @ j).tocsc()
    close = 0.5e-3
    push = np.zeros((len(reps), 3))
    push[:, 0] = spring * close
    q = factor(total).solve(j.T @ push.ravel())
    moved = (j @ q).reshape(-1, 3)[:, 0]
    force = float((spring * (close - moved)).sum()) / 2
    u = (whole.t @ q).reshape(-1, 3)
    x = mesh.nodes
    lattice = np.stack(np.meshgrid(*[np.linspace(0, edge, 7)] * 3, indexing="ij"), -1).reshape(-1, 3) + x.min(0)
    element, w = mesh.embed(lattice)
    at_lattice = np.einsum("pa,pai->pi", w, u[mesh.elements[element]])
    stiffness = force / (2 * close)
    shift = sorted(round(1e3 * abs(o), 4) for o in offset)
    truth = TRUTH.get((round(1e3 * pad, 4), shift[1])) if shift[0] == 0 else None
    d7 = deformation(lattice, lattice + at_lattice)
    return dict(
        test="small_strain",
        resolution=resolution,
        pad_mm=round(1e3 * pad, 4),
        pad_offset_mm=[round(1e3 * o, 4) for o in offset],
        contact="near_rigid" if near_rigid else "softvt",
        stiffness_n_per_m=stiffness,
        stiffness_error_pct=100 * (stiffness / truth[0] - 1) if truth else None,
        d_pct_per_mm_7cubed=d7,
        d_error_pct=100 * (d7 / truth[1] - 1) if truth else None,
        d_pct_per_mm=deformation(x, x + u),
        d_volume_pct_per_mm=deformation(x, x + u, mesh.product()),
    )
