"""Sampled contact with coverage, anchored Coulomb friction by return mapping.

A sample of area A under coverage c in 0..1 and gap phi < 0 feels f_n = k (-phi), k = C A c, and the tangential
spring f_t = -k/2 (t - anchor), bounded by mu f_n. The anchor is where the sample was, in the collider's frame, at the
end of the load step before it touched; a slipping anchor is dragged so that k/2 |t - anchor| = mu f_n.
"""

import numpy as np

TANGENTIAL = 0.5
RIGID = 1e9
LAYER = 7.0  # modulus of a soft surface in E/h


def modulus(youngs, edge, collider=RIGID):
    """Normal modulus per area, Pa/m: min(1e9, LAYER E/h) of the body in series with the collider's."""
    soft = min(RIGID, LAYER * youngs / edge)
    return 1.0 / (1.0 / soft + 1.0 / collider)


class Face:
    """A flat axis-aligned face: outward normal `sign` along `axis` at coordinate `at`; `half` extents or None."""

    def __init__(self, axis, sign, at, centre=(0.0, 0.0), half=None):
        self.axis, self.sign, self.at = axis, sign, at
        self.tangents = [a for a in range(3) if a != axis]
        self.centre, self.half = np.array(centre, float), half

    def coverage(self, t, cell):
        """Coverage (n,) of square cells at tangential positions t (n, 2), and its slope (n, 2)."""
        if self.half is None:
            return np.ones(len(t)), np.zeros(t.shape)
        off = t - self.centre
        raw = (self.half - np.abs(off)) / cell[:, None] + 0.5
        c = np.clip(raw, 0.0, 1.0)
        slope = np.where((raw > 0) & (raw < 1), -np.sign(off) / cell[:, None], 0.0)
        return c[:, 0] * c[:, 1], slope * c[:, ::-1]


class Friction:
    """Memory of one face: which samples touch, their anchors (n, 2), and where all were at the last step (n, 2)."""

    def __init__(self, face, rest):
        n = len(rest)
        self.touching, self.anchor = np.zeros(n, bool), np.zeros((n, 2))
        self.last = rest[:, face.tangents] - face.centre

    def copy(self):
        other = object.__new__(Friction)
        other.touching, other.anchor, other.last = self.touching.copy(), self.anchor.copy(), self.last.copy()
        return other


def respond(face, memory, x, area, cell, c_modulus, mu):
    """Forces on the samples at x (n, 3): dict with the indices that touch, force and slope -d force/d x, and flags."""
    phi = face.sign * (x[:, face.axis] - face.at)
    near = np.where(phi < 0)[0]
    cover, slope = face.coverage(x[near][:, face.tangents], cell[near])
    on = cover > 0
    idx, cover, slope = near[on], cover[on], slope[on]
    phi = phi[idx]
    k0 = c_modulus * area[idx]
    k = k0 * cover
    fn, dfn_t = -k * phi, -(k0 * phi)[:, None] * slope
    t = x[idx][:, face.tangents] - face.centre
    anchor = np.where(memory.touching[idx, None], memory.anchor[idx], memory.last[idx])
    s = t - anchor
    length = np.linalg.norm(s, axis=1)
    slip = TANGENTIAL * k * length > mu * fn
    unit = s / np.maximum(length, 1e-30)[:, None]
    kt = np.where(slip, mu * fn / np.maximum(length, 1e-30), TANGENTIAL * k)
    ft = -kt[:, None] * s
    eye = np.eye(2)[None]
    dft_n = np.where(slip[:, None], mu * k[:, None] * unit, 0.0)
    stick = -TANGENTIAL * k[:, None, None] * eye - TANGENTIAL * s[:, :, None] * (k0[:, None] * slope)[:, None, :]
    slide = -kt[:, None, None] * (eye - unit[:, :, None] * unit[:, None, :]) - mu * unit[:, :, None] * dfn_t[:, None, :]
    dft_t = np.where(slip[:, None, None], slide, stick)
    force, jac = np.zeros((len(idx), 3)), np.zeros((len(idx), 3, 3))
    a, tt = face.axis, face.tangents
    force[:, a], force[:, tt] = face.sign * fn, ft
    jac[:, a, a] = -k
    jac[:, a, tt] = face.sign * dfn_t
    jac[np.ix_(range(len(idx)), tt, [a])] = face.sign * dft_n[:, :, None]
    jac[np.ix_(range(len(idx)), tt, tt)] = dft_t
    moved = np.where(slip[:, None], t - unit * (mu * fn / np.maximum(TANGENTIAL * k, 1e-30))[:, None], anchor)
    return dict(idx=idx, force=force, slope=-jac, slip=slip, fn=fn, ft=np.linalg.norm(ft, axis=1), anchor=moved)


def commit(face, memory, x, answer):
    """End of a load step: anchors follow slip, samples that left forget theirs."""
    memory.touching[:] = False
    memory.touching[answer["idx"]] = True
    memory.anchor[answer["idx"]] = answer["anchor"]
    memory.last = x[:, face.tangents] - face.centre
