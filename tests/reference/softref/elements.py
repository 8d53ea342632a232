"""Element rows: patch test, bar, cantilever, and the clamped corotated squeeze published outside softvt."""

import numpy as np

from .element import CORNERS, GAUSS, SUBPOINTS, Corotated, filled_stiffness, full_stiffness, gradients, polar
from .measure import deformation
from .mesh import block
from .statics import GRAVITY, Elastic, factor
from .truth import bbar_stiffness

E, NU, RHO = 3e4, 0.4, 300.0


def _dofs(nodes, axis):
    return 3 * np.asarray(nodes) + axis


def _linear(mesh, youngs, poisson, fixed, value, load=None):
    """Small-strain displacement (n, 3) and reactions with the degrees of freedom `fixed` held at `value`."""
    whole = Elastic(mesh, youngs, poisson)
    k = whole.reduce(np.broadcast_to(full_stiffness(mesh.edge, youngs, poisson), (len(mesh.elements), 24, 24))).tocsr()
    u = np.zeros(k.shape[0])
    u[fixed] = value
    free = np.setdiff1d(np.arange(len(u)), fixed)
    f = np.zeros(len(u)) if load is None else load.ravel()
    u[free] = factor(k[free][:, free]).solve((f - k @ u)[free])
    return u.reshape(-1, 3), (k @ u - f).reshape(-1, 3)


def patch():
    """A linear field on the boundary of 4^3 voxels is linear inside."""
    mesh = block([4] * 3, 0.0125)
    x = mesh.nodes
    inside = np.all((x > 1e-9) & (x < 0.05 - 1e-9), axis=1)
    g = np.array([[1e-3, 2e-3, -1e-3], [0.5e-3, -2e-3, 1e-3], [1e-3, 0, 1.5e-3]])
    boundary = np.where(~inside)[0]
    fixed = (3 * boundary[:, None] + np.arange(3)).ravel()
    u, _ = _linear(mesh, E, NU, fixed, (x @ g.T)[boundary].ravel())
    lam, mu = E * NU / (1 + NU) / (1 - 2 * NU), E / 2 / (1 + NU)
    e = (g + g.T) / 2
    stress = lam * np.trace(e) * np.eye(3) + 2 * mu * e
    k0, us = full_stiffness(mesh.edge, E, NU), u[mesh.elements].reshape(-1, 24)
    energy = 0.5 * np.einsum("ni,ij,nj->", us, k0, us)
    return [
        dict(
            test="patch",
            grad_u=g.tolist(),
            max_rel_disp_error=float(np.abs(u - x @ g.T).max() / np.abs(u).max()),
            energy_j=energy,
            energy_exact_j=0.5 * float(np.tensordot(stress, e)) * 0.05**3,
        )
    ]


def bar():
    """Uniaxial strain of 1 % of a bar with free sides."""
    rows = []
    for n in (2, 4):
        mesh = block([5 * n, n, n], 0.02 / n)
        x, w, eps = mesh.nodes, 0.02, 0.01
        lo, hi = np.where(x[:, 0] < 1e-9)[0], np.where(x[:, 0] > 0.1 - 1e-9)[0]
        y0, z0 = np.where(x[:, 1] < 1e-9)[0], np.where(x[:, 2] < 1e-9)[0]
        fixed = np.r_[_dofs(lo, 0), _dofs(hi, 0), _dofs(y0, 1), _dofs(z0, 2)]
        value = np.r_[0.0 * lo, 0 * hi + eps * 0.1, 0.0 * y0, 0.0 * z0]
        u, f = _linear(mesh, E, NU, fixed, value)
        side = np.where(x[:, 1] > w - 1e-9)[0]
        rows.append(
            dict(
                test="bar",
                n=n,
                strain=eps,
                e_recovered_pa=float(f[hi, 0].sum() / (w * w * eps)),
                nu_recovered=float(-u[side, 1].mean() / w / eps),
                e_pa=E,
                nu=NU,
            )
        )
    return rows


def _fillings():
    """Filled sub-points: all, single points, cuts by planes, and random ones."""
    rng = np.random.default_rng(0)
    yield np.ones(len(SUBPOINTS), bool)
    for _ in range(10):
        yield np.arange(len(SUBPOINTS)) == rng.integers(len(SUBPOINTS))
        yield (SUBPOINTS - rng.uniform(0.2, 0.8, 3)) @ rng.normal(size=3) < 0
        yield rng.random(len(SUBPOINTS)) < rng.uniform(0.05, 0.95)


def fillings():
    """One voxel, however filled: forces of a homogeneous strain against stress times mean gradient, and the zero modes."""
    rows, h = [], 0.05 / 6
    g = np.array([[1e-3, 2e-3, -1e-3], [0.5e-3, -2e-3, 1e-3], [1e-3, 0, 1.5e-3]])
    e = (g + g.T) / 2
    for nu in (0.0, 0.3, 0.4, 0.499):
        error, modes, least = 0.0, [], []
        stress = E / (1 + nu) * (e + nu / (1 - 2 * nu) * np.trace(e) * np.eye(3))
        for inside in _fillings():
            k = filled_stiffness(inside, h, E, nu)
            mean = gradients(GAUSS if inside.all() else SUBPOINTS[inside]).mean(0)
            exact = inside.mean() * h * h * mean @ stress
            error = max(error, np.abs(k @ (CORNERS * h @ g.T).ravel() - exact.ravel()).max() / np.abs(exact).max())
            values = np.linalg.eigvalsh(k) / (E * h)
            modes.append(int((np.abs(values) < 1e-10).sum()))
            least.append(float(values[modes[-1]]))
        row = dict(test="fillings", nu=nu, voxels=len(modes), max_rel_force_error=float(error))
        rows.append(row | dict(zero_modes=[min(modes), max(modes)], least_stiffness_over_eh=min(least)))
    return rows


def bending():
    """Pure bending of a bar one voxel thick: end moment over that of the beam with free sides, E I."""
    rows, h = [], 0.01
    for nu in (0.0, 0.3, 0.4, 0.499):
        mesh = block([8, 1, 1], h)
        x, kappa = mesh.nodes, 0.1
        lo, hi = np.where(x[:, 0] < 1e-9)[0], np.where(x[:, 0] > 8 * h - 1e-9)[0]
        arm = x[:, 2] - h / 2
        fixed = np.r_[_dofs(lo, 0), _dofs(hi, 0), _dofs(lo[:2], 2), _dofs(lo[0], 1)]
        value = np.r_[0 * arm[lo], 8 * h * kappa * arm[hi], 0, 0, 0]
        _, f = _linear(mesh, E, nu, fixed, value)
        rows.append(dict(test="bending", nu=nu, moment_over_ei=float(f[hi, 0] @ arm[hi] / (E * h**4 / 12 * kappa))))
    return rows


def cantilever():
    """Tip deflection under gravity against Timoshenko with Cowper's shear coefficient (1966)."""
    rows, length, h, youngs = [], 0.10, 0.02, 3e5
    for nu in (0.0, 0.3, 0.4):
        inertia, area = h**4 / 12, h * h
        q, shear = RHO * GRAVITY * area, youngs / (2 * (1 + nu))
        kappa = 10 * (1 + nu) / (12 + 11 * nu)
        exact = q * length**4 / (8 * youngs * inertia) + q * length**2 / (2 * kappa * shear * area)
        for n in (2, 4, 8):
            mesh = block([5 * n, n, n], h / n)
            x = mesh.nodes
            load = np.zeros(x.shape)
            load[:, 2] = -RHO * GRAVITY * mesh.lumps
            clamped = np.where(x[:, 0] < 1e-9)[0]
            u, _ = _linear(mesh, youngs, nu, (3 * clamped[:, None] + np.arange(3)).ravel(), 0.0, load)
            tip = -u[x[:, 0] > length - 1e-9, 2].mean()
            rows.append(
                dict(
                    test="cantilever",
                    n_across=n,
                    nu=nu,
                    e_pa=youngs,
                    length_m=length,
                    height_m=h,
                    density=RHO,
                    tip_m=float(tip),
                    timoshenko_m=exact,
                    ratio=float(tip / exact),
                )
            )
    return rows


class _PerPoint:
    """The same hexahedron with a rotation at each Gauss point: only to compare with the published row."""

    def __init__(self, edge, rest):
        self.points = Corotated(rest, edge, np.zeros((24, 24))).gauss
        self.bulk, self.mu, self.volume = E / (3 - 6 * NU), E / 2 / (1 + NU), edge**3 / 8

    def gradient(self, x):
        """dU/dx of U = sum over points of V (mu |dev(R^T F - I)|^2 + bulk/2 mean(tr(R^T F - I))^2)."""
        f = np.einsum("nai,paj->npij", x, self.points)
        r = polar(f.reshape(-1, 3, 3)).reshape(f.shape)
        s = np.swapaxes(r, 2, 3) @ f - np.eye(3)
        trace = np.trace(s, axis1=2, axis2=3)
        mean = trace.mean(1, keepdims=True)
        dev = s - trace[..., None, None] / 3 * np.eye(3)
        stress = 2 * self.mu * dev + (self.bulk * mean)[..., None, None] * np.eye(3)
        return self.volume * np.einsum("npij,npjk,pak->nai", r, stress, self.points)


PUBLISHED = {
    "without": {48: 1.024, 46: 1.996, 44: 2.915, 42: 3.780, 38: 5.345, 34: 6.697, 30: 7.856},
    "gauss": {48: 1.022, 46: 1.989, 44: 2.899, 42: 3.751, 38: 5.281, 34: 6.582, 30: 7.675},
}


def clamped(law, resolution=6, edge=0.05, pad=0.022, gaps=(48, 46, 44, 42, 38, 34, 30)):
    """Nodes under two pads clamped and moved; law "exact" (softvt's), or those of the outside reference's rows, which have
    the B-bar element: "without" the term q, or "gauss".
    """
    mesh = block([resolution] * 3, edge / resolution)
    x = mesh.nodes
    under = np.all(np.abs(x[:, 1:] - edge / 2) <= pad / 2 + 1e-9, axis=1)
    lo, hi = np.where(under & (x[:, 0] < 1e-9))[0], np.where(under & (x[:, 0] > edge - 1e-9))[0]
    held = (3 * np.r_[lo, hi][:, None] + np.arange(3)).ravel()
    body = Elastic(mesh, E, NU)
    if law != "exact":
        body.batch.k0 = bbar_stiffness(np.full((1, 3), mesh.edge), E, NU)[0]
    points = _PerPoint(mesh.edge, mesh.nodes[mesh.elements])

    def force(now):
        f, st = body.force(now, law == "exact")
        return (body.gather_t @ points.gradient(now[mesh.elements]).ravel() if law == "gauss" else f), st

    free = np.setdiff1d(np.arange(x.size), held)
    now, rows, squeeze = x.copy(), [], 0.0
    for gap in gaps:
        for target in np.linspace(squeeze, edge - gap * 1e-3, 3)[1:]:
            now[lo, 0], now[hi, 0] = target / 2, edge - target / 2
            f, st = force(now)
            for _ in range(200):
                if np.linalg.norm(f[free]) < 1e-9:
                    break
                k = body.tangent(st, law == "exact").tocsr()
                du = np.zeros(x.size)
                du[free] = -factor(k[free][:, free]).solve(f[free])
                now = now + du.reshape(-1, 3)
                f, st = force(now)
            squeeze = target
        rows.append(
            dict(
                test="clamped",
                law=law,
                gap_mm=gap,
                force_n=float(f.reshape(-1, 3)[lo, 0].sum()),
                residual_n=float(np.linalg.norm(f[free])),
                published_n=PUBLISHED.get(law, {}).get(gap),
                d_pct=deformation(x, now),
                min_det_f=float(body.batch.min_det(now[mesh.elements]).min()),
            )
        )
    return rows


def spurious():
    """Largest net moment and energy-derivative error of one strained element, relative."""
    rng, h = np.random.default_rng(0), 0.05 / 6
    rest = CORNERS * h
    one = Corotated(rest[None], h, full_stiffness(h, E, NU)[None])
    x = rest[None] @ np.diag([0.7, 1.1, 1.15]) + 0.05 * h * rng.normal(size=(1, 8, 3))
    out = dict(test="element")
    for name, q in (("exact", True), ("without", False)):
        st = one.state(x)
        g = one.gradient(st, q)
        numeric = np.zeros(24)
        for i in range(24):
            d = np.zeros(24)
            d[i] = 1e-7
            d = d.reshape(1, 8, 3)
            numeric[i] = (one.state(x + d)["energy"] - one.state(x - d)["energy"])[0] / 2e-7
        scale = np.abs(g).max()
        out[f"force_error_{name}"] = float(np.abs(g.ravel() - numeric).max() / scale)
        out[f"moment_{name}"] = float(np.abs(np.cross(x[0], g[0]).sum(0)).max() / scale / h)
    return [out]


def rows():
    """All element rows."""
    out = patch() + fillings() + bar() + bending() + cantilever() + spurious()
    for law in ("exact", "without", "gauss"):
        out += clamped(law)
    return out
