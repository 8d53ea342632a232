"""Mirror symmetry as a linear reduction: u = T q, and orbits with their sizes as weights."""

import numpy as np
import scipy.sparse as sp


def _key(points):
    return [tuple(k) for k in np.rint(points * 1e8).astype(np.int64)]


def orbits(points, mirrors):
    """Representatives of `points` (n, 3) under mirrors {axis: plane}, and the size of each orbit.

    A representative lies on the low side of every plane: only the pad on that side is modelled.
    """
    folded = points.copy()
    high = np.zeros(len(points), int)
    for axis, plane in mirrors.items():
        folded[:, axis] = plane + np.abs(points[:, axis] - plane)
        high += points[:, axis] > plane + 1e-9
    keys, seen, first, size = _key(folded), {}, [], []
    for i in np.argsort(high, kind="stable"):
        k = keys[i]
        if k in seen:
            size[seen[k]] += 1
        else:
            seen[k] = len(first)
            first.append(i)
            size.append(1)
    return np.array(first), np.array(size, float)


def reduction(points, mirrors, fixed=()):
    """T (3n, m): displacement from the free displacements; `fixed` are degrees of freedom held at zero."""
    folded, sign = points.copy(), np.ones(points.shape)
    for axis, plane in mirrors.items():
        offset = points[:, axis] - plane
        folded[:, axis] = plane + np.abs(offset)
        sign[:, axis] = np.where(np.abs(offset) < 1e-9, 0.0, np.sign(offset))
    index = {}
    rep = np.array([index.setdefault(k, len(index)) for k in _key(folded)])
    dof = 3 * rep[:, None] + np.arange(3)
    data = sign.ravel()
    data[list(fixed)] = 0.0
    full = sp.csc_matrix((data, (np.arange(points.size), dof.ravel())), (points.size, 3 * len(index)))
    full.eliminate_zeros()
    return full[:, np.diff(full.indptr) > 0].tocsr()
