"""Corotated B-bar hexahedron: one rotation per element, exact forces, exact tangent.

Energy of an element, with nodes x_a, rest nodes X_a, stiffness K0 and R = polar(F):

    U = 1/2 (y - X)^T K0 (y - X),   y_a = R^T x_a,   F = sum_a x_a g_a^T,

g_a being the mean of the shape gradients over the points that integrate K0, with their volumes. As R depends on x, the force is
-dU/dx_a = -R (p_a - q x g_a) with p = K0 (y - X), S = R^T F, m = sum_a y_a x p_a, q = (tr S I - S)^-1 m.

B-bar: Hughes, The Finite Element Method, 2000, 4.5.2. Corotation: Mueller & Gross 2004; the term q follows from
differentiating the polar decomposition (RtdF - dFtR = [(tr S I - S) w]x for dR = R [w]x).
"""

import numpy as np

CORNERS = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)], float)
SUB = 6
GAUSS = np.array([[0.5 + 0.5 * s / np.sqrt(3.0) for s in p] for p in 2 * CORNERS - 1])
SUBPOINTS = (np.stack(np.meshgrid(*[np.arange(SUB)] * 3, indexing="ij"), -1).reshape(-1, 3)[:, ::-1] + 0.5) / SUB


def weights(xi):
    """Trilinear weights (n, 8) at local points xi (n, 3) of the unit cube."""
    xi = np.atleast_2d(xi)[:, None, :]
    return np.prod(np.where(CORNERS[None] > 0.5, xi, 1.0 - xi), axis=2)


def gradients(xi):
    """Gradients (n, 8, 3) of the trilinear weights with respect to the local coordinates."""
    xi = np.atleast_2d(xi)[:, None, :]
    factor = np.where(CORNERS[None] > 0.5, xi, 1.0 - xi)
    slope = np.where(CORNERS > 0.5, 1.0, -1.0)[None]
    out = np.empty(factor.shape)
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        out[:, :, axis] = slope[:, :, axis] * factor[:, :, b] * factor[:, :, c]
    return out


GHOST = 0.05  # share of the full stiffness that a partly filled voxel has besides that of its filled points


def mean_gradient(inside, edge):
    """Shape gradients (8, 3) averaged over the material of a voxel of the given edge, 1/m.

    `inside` are its filled sub-points (216 booleans). A partly filled voxel has GHOST of a full one besides.
    """
    whole = gradients(GAUSS).mean(0)
    if inside.all():
        return whole / edge
    filled, share = gradients(SUBPOINTS[inside]).mean(0), inside.mean()
    return (share * filled + GHOST * whole) / (share + GHOST) / edge


def bbar_stiffness(points, volumes, edge, youngs, poisson):
    """B-bar stiffness (24, 24), N/m, by the quadrature `points` (local) with `volumes` (m^3).

    The mean dilatation is the average over these same points.
    """
    lam = youngs * poisson / ((1 + poisson) * (1 - 2 * poisson))
    mu = youngs / (2 * (1 + poisson))
    grad = gradients(points) / edge
    volumes = np.asarray(volumes, float)
    div = grad.reshape(len(grad), 24)
    mean_div = volumes @ div / volumes.sum()
    elastic = np.diag([2 * mu] * 3 + [mu] * 3)
    elastic[:3, :3] += lam
    stiffness = np.zeros((24, 24))
    for g, d, v in zip(grad, div, volumes):
        b = np.zeros((6, 24))
        for a in range(8):
            x, y, z = g[a]
            b[:, 3 * a : 3 * a + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
        b[:3] += (mean_div - d) / 3.0
        stiffness += v * b.T @ elastic @ b
    return 0.5 * (stiffness + stiffness.T)


def full_stiffness(edge, youngs, poisson):
    """Stiffness of a wholly filled voxel: 2x2x2 Gauss."""
    return bbar_stiffness(GAUSS, np.full(8, edge**3 / 8), edge, youngs, poisson)


def filled_stiffness(inside, edge, youngs, poisson):
    """Stiffness of a voxel of which the sub-points `inside` (216 booleans) are filled."""
    full = full_stiffness(edge, youngs, poisson)
    if inside.all():
        return full
    part = bbar_stiffness(SUBPOINTS[inside], np.full(inside.sum(), (edge / SUB) ** 3), edge, youngs, poisson)
    return part + GHOST * full


def cross_matrix(v):
    """[v]x for v (..., 3): shape (..., 3, 3)."""
    out = np.zeros(v.shape + (3,))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def polar(f):
    """Nearest proper rotation of f (n, 3, 3)."""
    u, _, vt = np.linalg.svd(f)
    u[np.linalg.det(u @ vt) < 0, :, 2] *= -1
    return u @ vt


class Corotated:
    """A batch of n elements with rest corners `rest` (n, 8, 3), stiffness `k0` (n, 24, 24) or (24, 24) and mean
    gradients `g` (n, 8, 3); without `g`, those of full voxels.
    """

    def __init__(self, rest, edge, k0, g=None):
        full = mean_gradient(np.ones(len(SUBPOINTS), bool), edge)
        self.rest, self.k0, self.g = rest, k0, np.broadcast_to(full, (len(rest), 8, 3)) if g is None else g
        self.gauss = gradients(GAUSS) / edge

    def state(self, x):
        """Energy per element and the pieces that force and tangent share."""
        f = np.einsum("nai,naj->nij", x, self.g)
        r = polar(f)
        y = x @ r
        d = (y - self.rest).reshape(-1, 24, 1)
        p = (self.k0 @ d).reshape(-1, 8, 3)
        s = np.swapaxes(r, 1, 2) @ f
        s = 0.5 * (s + np.swapaxes(s, 1, 2))
        inv = np.linalg.inv(np.trace(s, axis1=1, axis2=2)[:, None, None] * np.eye(3) - s)
        m = np.cross(y, p).sum(1)
        q = np.einsum("nij,nj->ni", inv, m)
        energy = 0.5 * np.einsum("ni,ni->n", d[:, :, 0], p.reshape(-1, 24))
        return dict(r=r, y=y, p=p, s=s, inv=inv, q=q, energy=energy)

    def gradient(self, st, projection=True):
        """dU/dx (n, 8, 3), minus the nodal forces. Without `projection` the term q is left out."""
        t = st["p"] - np.cross(st["q"][:, None], self.g) if projection else st["p"]
        return np.einsum("nij,naj->nai", st["r"], t)

    def warped_tangent(self, st):
        """R K0 R^T (n, 24, 24): the SPD tangent."""
        return self._rotate(np.broadcast_to(self.k0, (len(st["r"]), 24, 24)), st["r"])

    def exact_tangent(self, st):
        """The second derivative of U (n, 24, 24)."""
        n, g = len(st["r"]), self.g
        y, p, q, s, inv = st["y"], st["p"], st["q"], st["s"], st["inv"]
        gx = cross_matrix(g)  # d -> g_a x d_a
        w = inv @ gx.transpose(0, 2, 1, 3).reshape(n, 3, 24)  # spin of R per nodal motion
        jy = np.eye(24) + cross_matrix(y).reshape(n, 24, 3) @ w
        jp = self.k0 @ jy
        yc, pc = cross_matrix(y), cross_matrix(p)
        jm = np.einsum("naij,najk->nik", yc, jp.reshape(n, 8, 3, 24)) - np.einsum("naij,najk->nik", pc, jy.reshape(n, 8, 3, 24))
        # dS = D - [w]S with D = sum d_a g_a^T; dA q = tr(dS) q - dS q
        gq = np.einsum("naj,nj->na", g, q)
        dq = np.zeros((n, 3, 24))
        for a in range(8):
            dq[:, :, 3 * a : 3 * a + 3] = gq[:, a, None, None] * np.eye(3)
        sq = np.einsum("nij,nj->ni", s, q)
        dsq = dq + cross_matrix(sq) @ w  # -[w] S q = [Sq] w
        trace = g.reshape(n, 24)  # tr([w]S) = 0 for symmetric S
        jaq = q[:, :, None] * trace[:, None, :] - dsq
        jq = inv @ (jm - jaq)
        t = p - np.cross(q[:, None], g)
        jt = jp + np.einsum("naij,njk->naik", gx, jq).reshape(n, 24, 24)
        jt = jt - cross_matrix(t).reshape(n, 24, 3) @ w
        jt = 0.5 * (jt + np.swapaxes(jt, 1, 2))
        return self._rotate(jt, st["r"])

    @staticmethod
    def _rotate(k, r):
        n = len(r)
        k = np.einsum("nij,najbk->naibk", r, k.reshape(n, 8, 3, 8, 3), optimize=True)
        return np.einsum("naibk,nlk->naibl", k, r, optimize=True).reshape(n, 24, 24)

    def min_det(self, x):
        """Smallest det F over the eight Gauss points of each element."""
        f = np.einsum("nai,paj->npij", x, self.gauss)
        return np.linalg.det(f).min(1)
