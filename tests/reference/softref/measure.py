"""Deformation metric."""

import numpy as np
import scipy.sparse as sp


def deformation(rest, now, product=None, diagonal=None):
    """RMS displacement after the best rigid motion (Kabsch 1976), % of `diagonal`.

    Means and squares are taken in the inner product of nodal fields `product` (n, n), the integral of N_a N_b; without it
    every node counts alike. The diagonal is by default that of the rest nodes' box.
    """
    product = sp.identity(len(rest)) / len(rest) if product is None else product / product.sum()
    share = np.asarray(product.sum(0)).ravel()
    a, b = rest - share @ rest, now - share @ now
    u, _, vt = np.linalg.svd(a.T @ (product @ b))
    sign = np.sign(np.linalg.det(u @ vt))
    left = a @ (u @ np.diag([1, 1, sign]) @ vt) - b
    rms = np.sqrt((left * (product @ left)).sum())
    return float(100 * rms / (np.linalg.norm(np.ptp(rest, axis=0)) if diagonal is None else diagonal))
