"""Converged small-strain pad stiffness on graded bricks whose lines meet the pad's edge: clamped (sticking) pads.

No voxels and no contact law here: this is what softvt's voxel solution is judged against. One fourth (pad offset in y)
or one eighth of the cube is meshed; the squeeze axis is x and both pads move by 0.5 mm.
"""

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import RegularGridInterpolator

from .element import GAUSS, gradients
from .measure import deformation
from .statics import factor


def _graded(length, first, ratio):
    """Cell sizes that grow from `first` by about `ratio` and fill `length`."""
    n = max(1, int(np.ceil(np.log(1 + length * (ratio - 1) / first) / np.log(ratio))))
    sizes = first * ratio ** np.arange(n)
    return sizes * length / sizes.sum()


def _axis(low, high, edges, first, ratio):
    """Grid lines from low to high, graded towards each of the points `edges`."""
    lines = [low]
    stops = [low] + sorted(e for e in edges if low < e < high) + [high]
    for a, b in zip(stops, stops[1:]):
        fine_a, fine_b = a in edges, b in edges
        if fine_a and fine_b:
            half = _graded((b - a) / 2, first, ratio)
            sizes = np.r_[half, half[::-1]]
        else:
            sizes = _graded(b - a, first, ratio)
            sizes = sizes if fine_a else sizes[::-1]
        lines += list(a + np.cumsum(sizes))
        lines[-1] = b
    return np.array(lines)


def bbar_stiffness(size, youngs, poisson):
    """B-bar stiffness (n, 24, 24) of bricks of sides `size` (n, 3), with the mean dilatation (Hughes 2000, 4.5.2)."""
    lam, mu = youngs * poisson / (1 + poisson) / (1 - 2 * poisson), youngs / 2 / (1 + poisson)
    g = gradients(GAUSS)[None] / size[:, None, None, :]
    n = len(size)
    div = g.reshape(n, 8, 24)
    b = np.zeros((n, 8, 6, 24))
    for a in range(8):
        for axis in range(3):
            b[:, :, axis, 3 * a + axis] = g[:, :, a, axis]
        for row, (i, j) in enumerate(((0, 1), (1, 2), (0, 2)), start=3):
            b[:, :, row, 3 * a + i] = g[:, :, a, j]
            b[:, :, row, 3 * a + j] = g[:, :, a, i]
    b[:, :, :3] += ((div.mean(1, keepdims=True) - div) / 3)[:, :, None]
    elastic = np.diag([2 * mu] * 3 + [mu] * 3)
    elastic[:3, :3] += lam
    weighted = np.einsum("rs,npsj->nprj", elastic, b) * (size.prod(1) / 8)[:, None, None, None]
    return np.swapaxes(b.reshape(n, 48, 24), 1, 2) @ weighted.reshape(n, 48, 24)


def solve(pad, offset_y, first, ratio, edge=0.05, youngs=3e4, poisson=0.4):
    """Stiffness (N/m) and D (% per mm, 7^3 equal-weight nodes) on one graded mesh."""
    half = edge / 2
    x = _axis(0.0, half, [half], first, ratio)
    z = _axis(0.0, half, [pad / 2], first, ratio)
    y = _axis(-half if offset_y else 0.0, half, [offset_y - pad / 2, offset_y + pad / 2], first, ratio)
    count = [len(a) - 1 for a in (x, y, z)]
    cell = np.stack(np.meshgrid(*[np.arange(c) for c in count], indexing="ij"), -1).reshape(-1, 3)
    size = np.stack([np.diff(a)[cell[:, i]] for i, a in enumerate((x, y, z))], 1)
    shape = np.array(count) + 1
    node = np.stack([np.ravel_multi_index((cell + [c & 1, c >> 1 & 1, c >> 2 & 1]).T, shape) for c in range(8)], 1)
    p = np.stack(np.meshgrid(x, y, z, indexing="ij"), -1).reshape(-1, 3)
    dof = (3 * node[:, :, None] + np.arange(3)).reshape(-1, 24)
    k = sp.csr_matrix(
        (bbar_stiffness(size, youngs, poisson).ravel(), (np.repeat(dof, 24, 1).ravel(), np.tile(dof, (1, 24)).ravel())), (p.size, p.size)
    )
    under = (p[:, 0] > half - 1e-12) & (np.abs(p[:, 1] - offset_y) < pad / 2 + 1e-9) & (p[:, 2] < pad / 2 + 1e-9)
    held = np.zeros(p.shape, bool)
    for axis in (0, 2) if offset_y else (0, 1, 2):
        held[np.abs(p[:, axis]) < 1e-12, axis] = True
    held[under] = True
    u = np.zeros(p.shape)
    u[under, 0] = -0.5e-3
    free = np.where(~held.ravel())[0]
    flat = u.ravel()
    flat[free] = factor(k[free][:, free]).solve(-(k @ flat)[free])
    u = flat.reshape(-1, 3)
    force = -(k @ flat).reshape(-1, 3)[under, 0].sum() * (2 if offset_y else 4)
    return force / 1e-3, _lattice_d(u, (x, y, z), offset_y, edge), len(p)


def _lattice_d(u, lines, offset_y, edge):
    """D of the whole cube on its 7^3 lattice from the meshed part."""
    field = RegularGridInterpolator(lines, u.reshape([len(a) for a in lines] + [3]))
    c = np.linspace(-edge / 2, edge / 2, 7)
    p = np.stack(np.meshgrid(c, c, c, indexing="ij"), -1).reshape(-1, 3)
    sign = np.where(p < 0, -1.0, 1.0)
    if offset_y:
        sign[:, 1] = 1.0
    return deformation(p, p + sign * field(p * sign))


def rows(levels=((2e-4, 1.5), (1e-4, 1.4))):
    """Converged stiffness for the pads and offsets of the voxel rows."""
    for pad, offset in ((22, 0.0), (18, 0.0), (20, 0.0), (24, 0.0), (22, 50 / 12)):
        for first, ratio in levels:
            k, d, nodes = solve(1e-3 * pad, 1e-3 * offset, first, ratio)
            yield dict(
                test="truth",
                pad_mm=float(pad),
                pad_offset_y_mm=offset,
                first_cell_mm=1e3 * first,
                ratio=ratio,
                nodes=nodes,
                stiffness_n_per_m=float(k),
                d_pct_per_mm_7cubed=d,
            )
