"""Voxel meshes of softvt's rule, and surface samples with areas. Bodies rest on z = 0, centred on the z axis."""

import numpy as np
import scipy.sparse as sp

from .element import CORNERS, GAUSS, SUB, SUBPOINTS, weights

LEAST_FILL = 0.01
MASS_FLOOR = 1e-3


class Body:
    """A shape: `inside(points) -> bool`, `bounds` (2, 3), `volume` (m^3), `samples(spacing) -> points, areas, cell`."""

    def __init__(self, inside, size, volume, samples, label):
        self.inside, self.volume, self.samples, self.label = inside, volume, samples, label
        self.size = size = np.asarray(size, float)
        self.bounds = np.array([[-size[0] / 2, -size[1] / 2, 0.0], [size[0] / 2, size[1] / 2, size[2]]])


class Mesh:
    """Nodes (n, 3), elements (m, 8), filled share (m,), masses (n,), and per element an index into `patterns`."""

    def __init__(self, nodes, elements, edge, inside, body=None):
        self.nodes, self.elements, self.edge = nodes, elements, edge
        self.patterns, self.pattern_of = np.unique(inside, axis=0, return_inverse=True)
        self.pattern_of = self.pattern_of.ravel()
        self.fill = inside.mean(1)
        self.lumps = np.zeros(len(nodes))
        sub = weights(SUBPOINTS)
        for e, ins in zip(elements, inside):
            self.lumps[e] += sub[ins].sum(0) * (edge / SUB) ** 3
        self.lumps = np.maximum(self.lumps, MASS_FLOOR * edge**3)
        if body is not None:
            self.lumps *= body.volume / self.lumps.sum()

    def product(self):
        """Integral of N_a N_b over the material, sparse (n, n) in m^3: exact in full voxels, else by the filled sub-points."""
        table = [weights(GAUSS if p.all() else SUBPOINTS[p]) for p in self.patterns]
        table = np.array([p.mean() * self.edge**3 * w.T @ w / len(w) for p, w in zip(self.patterns, table)])
        pairs = np.repeat(self.elements, 8, 1).ravel(), np.tile(self.elements, (1, 8)).ravel()
        return sp.csr_matrix((table[self.pattern_of].ravel(), pairs), [len(self.nodes)] * 2)

    def diagonal(self):
        """Diagonal of the bounding box of the nodes, m."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    def embed(self, points):
        """Element and trilinear weights of points; outside of every voxel, those of the nearest, extrapolated."""
        low = self.nodes[self.elements[:, 0]]
        local_min = low.min(0)
        cell = np.rint((low - local_min) / self.edge).astype(int)
        size = cell.max(0) + 1
        table = np.full(size, -1)
        table[tuple(cell.T)] = np.arange(len(cell))
        at = np.clip(((points - local_min) / self.edge).astype(int), 0, size - 1)
        element = table[tuple(at.T)]
        centre = low + self.edge / 2
        for i in np.where(element < 0)[0]:
            beyond = np.maximum(np.abs(centre - points[i]) - self.edge / 2, 0.0)
            element[i] = np.argmin((beyond**2).sum(1))
        local = (points - low[element]) / self.edge
        return element, weights(local)


def from_cells(cells, edge, origin, inside, body=None):
    """Mesh of the given integer cells (m, 3), nodes compact in x-fastest order."""
    corner = cells[:, None] + CORNERS[None].astype(int)
    flat, inverse = np.unique(corner.reshape(-1, 3)[:, ::-1], axis=0, return_inverse=True)
    nodes = origin + flat[:, ::-1] * edge
    return Mesh(nodes, inverse.reshape(-1, 8), edge, inside, body)


def voxel_mesh(body, resolution):
    """Cubes of edge longest/resolution; other axes ceil, centred; voxels that are at least 1 % filled."""
    size = body.bounds[1] - body.bounds[0]
    edge = size.max() / resolution
    count = np.ceil(size / edge - 1e-9).astype(int)
    origin = body.bounds.mean(0) - 0.5 * count * edge
    grid = np.stack(np.meshgrid(*[np.arange(c) for c in count[::-1]], indexing="ij"), -1).reshape(-1, 3)[:, ::-1]
    inside = np.array([body.inside(origin + (c + SUBPOINTS) * edge) for c in grid])
    keep = inside.mean(1) >= LEAST_FILL
    return from_cells(grid[keep], edge, origin, inside[keep], body)


def block(count, edge):
    """A block of full voxels, lowest corner at the origin."""
    grid = np.stack(np.meshgrid(*[np.arange(c) for c in count[::-1]], indexing="ij"), -1).reshape(-1, 3)[:, ::-1]
    return from_cells(grid, edge, np.zeros(3), np.ones((len(grid), SUB**3), bool))


def cube(edge):
    """A cube; each face a regular grid of cell-centred samples (only the faces x = +-edge/2 and z = 0 can touch)."""

    def samples(spacing):
        n = int(np.ceil(edge / spacing - 1e-9))
        c = (np.arange(n) + 0.5) / n * edge - edge / 2
        a, b = [m.ravel() for m in np.meshgrid(c, c, indexing="ij")]
        half = np.full(a.shape, edge / 2)
        points = np.concatenate([np.c_[-half, a, b + edge / 2], np.c_[half, a, b + edge / 2], np.c_[a, b, 0 * a]])
        cell = edge / n
        return points, np.full(len(points), cell**2), np.full(len(points), cell)

    return Body(
        lambda p: (np.abs(p[:, 0]) < edge / 2) & (np.abs(p[:, 1]) < edge / 2) & (p[:, 2] > 0) & (p[:, 2] < edge),
        [edge] * 3,
        edge**3,
        samples,
        "cube",
    )


def _round(profile, length):
    """Samples of a surface of revolution about y: `profile(s)` gives (y, r) over arc length s in 0..length."""

    def samples(spacing):
        n = int(np.ceil(length / spacing))
        n += n % 2
        points, areas, cells = [], [], []
        for i in range(n):
            s = (i + 0.5) / n * length
            y, r = profile(s)
            ring = 4 * max(1, int(np.ceil(2 * np.pi * r / spacing / 4)))
            angle = (np.arange(ring) + 0.5) / ring * 2 * np.pi
            area = length / n * 2 * np.pi * r / ring
            points.append(np.c_[r * np.cos(angle), np.full(ring, y), r * np.sin(angle)])
            areas.append(np.full(ring, area))
            cells.append(np.full(ring, np.sqrt(area)))
        return np.concatenate(points), np.concatenate(areas), np.concatenate(cells)

    return samples


def _lifted(samples, radius):
    def moved(spacing):
        points, areas, cells = samples(spacing)
        return points + [0, 0, radius], areas, cells

    return moved


def sphere(radius):
    """A sphere."""
    surface = _round(lambda s: (-radius * np.cos(s / radius), radius * np.sin(s / radius)), np.pi * radius)
    return Body(
        lambda p: np.linalg.norm(p - [0, 0, radius], axis=1) < radius,
        [2 * radius] * 3,
        4 / 3 * np.pi * radius**3,
        _lifted(surface, radius),
        "sphere",
    )


def capsule(radius, total):
    """A capsule lying along y."""
    mid, cap = total - 2 * radius, 0.5 * np.pi * radius

    def profile(s):
        if s < cap:
            return -mid / 2 - radius * np.cos(s / radius), radius * np.sin(s / radius)
        if s > cap + mid:
            t = (2 * cap + mid - s) / radius
            return mid / 2 + radius * np.cos(t), radius * np.sin(t)
        return -mid / 2 + s - cap, radius

    def inside(p):
        q = p - [0, 0, radius]
        q[:, 1] -= np.clip(q[:, 1], -mid / 2, mid / 2)
        return np.linalg.norm(q, axis=1) < radius

    return Body(
        inside,
        [2 * radius, total, 2 * radius],
        np.pi * radius**2 * mid + 4 / 3 * np.pi * radius**3,
        _lifted(_round(profile, 2 * cap + mid), radius),
        "capsule",
    )


def cylinder(radius, length):
    """A cylinder lying along y; its flat ends touch nothing and carry no samples."""
    surface = _round(lambda s: (s - length / 2, radius), length)
    return Body(
        lambda p: (np.hypot(p[:, 0], p[:, 2] - radius) < radius) & (np.abs(p[:, 1]) < length / 2),
        [2 * radius, length, 2 * radius],
        np.pi * radius**2 * length,
        _lifted(surface, radius),
        "cylinder",
    )
