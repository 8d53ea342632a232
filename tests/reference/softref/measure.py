"""Deformation metric."""

import numpy as np


def deformation(rest, now, weight=None):
    """RMS node displacement after the best rigid motion (Kabsch 1976), % of the diagonal of the rest nodes' box."""
    w = np.ones(len(rest)) if weight is None else weight
    w = w / w.sum()
    a, b = rest - w @ rest, now - w @ now
    u, _, vt = np.linalg.svd((a * w[:, None]).T @ b)
    sign = np.sign(np.linalg.det(u @ vt))
    turn = u @ np.diag([1, 1, sign]) @ vt
    rms = np.sqrt(w @ ((a @ turn - b) ** 2).sum(1))
    return float(100 * rms / np.linalg.norm(np.ptp(rest, axis=0)))
