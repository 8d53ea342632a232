"""Corotated hexahedron with incompatible modes: one rotation per element, exact forces, exact tangent.

Energy of an element, with nodes x_a, rest nodes X_a, stiffness K0 and R = polar(F):

    U = 1/2 (y - X)^T K0 (y - X),   y_a = R^T x_a,   F = sum_a x_a g_a^T,

g_a being the mean of the shape gradients over the material. As R depends on x, the force is
-dU/dx_a = -R (p_a - q x g_a) with p = K0 (y - X), S = R^T F, m = sum_a y_a x p_a, q = (tr S I - S)^-1 m.

Incompatible modes whose gradients have no mean: Wilson et al. 1973; Taylor, Beresford & Wilson 1976. Stiffness against
hourglass shapes alone: Flanagan & Belytschko 1981. Corotation: Mueller & Gross 2004; the term q follows from
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


GHOST = 0.05  # of a full voxel: what a partly filled one has besides its filled points


def mean_gradient(inside, edge):
    """Shape gradients (8, 3) averaged over the material of a voxel of the given edge, 1/m.

    `inside` are its filled sub-points (216 booleans). A partly filled voxel has GHOST of a full one besides.
    """
    whole = gradients(GAUSS).mean(0)
    if inside.all():
        return whole / edge
    filled, share = gradients(SUBPOINTS[inside]).mean(0), inside.mean()
    return (share * filled + GHOST * whole) / (share + GHOST) / edge


def quadrature(inside):
    """Points (n, 3) and weights (n,), in voxels, of the measure that integrates K0; `inside` are the filled sub-points.

    The ghost of a partly filled voxel is the spread of a strain over the Gauss points: it has no volume and no first moment.
    """
    if inside.all():
        return GAUSS, np.full(8, 1 / 8)
    points = np.concatenate([SUBPOINTS[inside], GAUSS, [[0.5] * 3]])
    return points, np.r_[np.full(inside.sum(), SUB**-3.0), np.full(8, GHOST / 8), -GHOST]


def filled_stiffness(inside, edge, youngs, poisson):
    """Stiffness K0 (24, 24), N/m, of a voxel of which the sub-points `inside` (216 booleans) are filled.

    Eleven scalar shapes: the trilinear ones and the incompatible (xi_k - c_k)^2, condensed at the end.
    """
    mu, bulk = youngs / (2 * (1 + poisson)), youngs / (3 * (1 - 2 * poisson))
    points, volumes = quadrature(inside)
    volumes = volumes * edge**3
    local = points - volumes @ points / volumes.sum()
    grad = np.concatenate([gradients(points), 2 * local[:, :, None] * np.eye(3)], axis=1) / edge
    div = grad.reshape(-1, 33)
    # strain (point, i, j, shape, component) of a unit amplitude, a tensor of nine
    half = 0.5 * np.einsum("nsj,ik->nijsk", grad, np.eye(3))
    strain = (half + half.swapaxes(1, 2)).reshape(-1, 9, 33)
    dev = strain - np.eye(3).reshape(1, 9, 1) / 3 * div[:, None]
    # the dilatation in the least-squares sense by 1, x, y, z: its energy is bulk/2 moment^T gram^-1 moment
    linear = np.c_[np.ones(len(local)), local]
    moment, gram = (linear * volumes[:, None]).T @ div, (linear * volumes[:, None]).T @ linear
    k = 2 * mu * np.einsum("n,nci,ncj->ij", volumes, dev, dev, optimize=True) + bulk * moment.T @ np.linalg.solve(gram, moment)
    k = k[:24, :24] - k[:24, 24:] @ np.linalg.solve(k[24:, 24:], k[24:, :24])
    return 0.5 * (k + k.T)


def full_stiffness(edge, youngs, poisson):
    """Stiffness of a wholly filled voxel."""
    return filled_stiffness(np.ones(SUB**3, bool), edge, youngs, poisson)


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
