"""Newton's method for a corotated soft body between flat faces, load step by load step."""

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from . import contact, symmetry
from .element import Corotated, filled_stiffness, mean_gradient

TOLERANCE = 1e-9
GRAVITY = 9.81


class NotConverged(RuntimeError):
    """No equilibrium was found for a load step."""


def factor(matrix):
    """Sparse LU for a structurally symmetric matrix."""
    return spl.splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.1, options=dict(SymmetricMode=True))


class Elastic:
    """Forces and tangents of a mesh in the reduced displacement q (x = rest + T q)."""

    def __init__(self, mesh, youngs, poisson, mirrors=None, fixed=()):
        self.mesh = mesh
        self.t = symmetry.reduction(mesh.nodes, mirrors or {}, fixed)
        centres = mesh.nodes[mesh.elements].mean(1)
        self.reps, self.share = symmetry.orbits(centres, mirrors or {})
        self.corners = mesh.elements[self.reps]
        table = np.array([filled_stiffness(p, mesh.edge, youngs, poisson) for p in mesh.patterns])
        means = np.array([mean_gradient(p, mesh.edge) for p in mesh.patterns])
        kinds = mesh.pattern_of[self.reps]
        self.batch = Corotated(mesh.nodes[self.corners], mesh.edge, table[kinds], means[kinds])
        dof = (3 * self.corners[:, :, None] + np.arange(3)).reshape(-1, 24)
        n = 3 * len(mesh.nodes)
        one = sp.csr_matrix((np.ones(dof.size), (np.arange(dof.size), dof.ravel())), (dof.size, n))
        self.gather = (one @ self.t).tocsr()
        self.gather_t = self.gather.T.tocsr()

    def force(self, x, projection=True):
        """Gradient of the energy in q, and the element state."""
        st = self.batch.state(x[self.corners])
        grad = self.batch.gradient(st, projection) * self.share[:, None, None]
        return self.gather_t @ grad.ravel(), st

    def tangent(self, st, exact=True):
        """Stiffness in q."""
        k = self.batch.exact_tangent(st) if exact else self.batch.warped_tangent(st)
        return self.reduce(k)

    def reduce(self, k):
        """Assemble element matrices (m, 24, 24) into the reduced matrix."""
        n = len(k)
        blocks = sp.bsr_matrix((k * self.share[:, None, None], np.arange(n), np.arange(n + 1)), (24 * n, 24 * n))
        return (self.gather_t @ (blocks @ self.gather)).tocsc()


class Scene:
    """A soft body, its samples, and named faces; `q` is the state, `memory` the friction history."""

    def __init__(self, mesh, body, youngs, poisson, density, mirrors, spacing):
        self.mesh, self.body = mesh, body
        self.elastic = Elastic(mesh, youngs, poisson, mirrors)
        points, area, cell = body.samples(spacing)
        reps, share = symmetry.orbits(points, mirrors)
        element, w = mesh.embed(points[reps])
        self.rest, self.area, self.cell, self.share = points[reps], area[reps], cell[reps], share
        rows = np.repeat(np.arange(len(reps)), 8)
        embed = sp.csr_matrix((w.ravel(), (rows, mesh.elements[element].ravel())), (len(reps), len(mesh.nodes)))
        self.embed3 = sp.kron(embed, sp.eye(3), format="csr")
        self.jacobian = (self.embed3 @ self.elastic.t).tocsr()
        self.x_rest = self.embed3 @ mesh.nodes.ravel()
        self.c_modulus = contact.modulus(youngs, mesh.edge)
        weight = np.zeros((len(mesh.nodes), 3))
        weight[:, 2] = -GRAVITY * density * mesh.lumps
        self.weight = self.elastic.t.T @ weight.ravel()
        self.weight_n = GRAVITY * density * mesh.lumps.sum()
        self.q = np.zeros(self.elastic.t.shape[1])
        self.faces, self.memory, self.mu = {}, {}, {}
        self.steps = self.iterations = 0

    def add(self, name, face, mu):
        """Puts a face into the scene."""
        self.faces[name], self.mu[name] = face, mu
        x = (self.x_rest + self.jacobian @ self.q).reshape(-1, 3)
        self.memory[name] = contact.Friction(face, x)

    def save(self):
        """State to come back to."""
        return self.q.copy(), {k: m.copy() for k, m in self.memory.items()}, {k: f.at for k, f in self.faces.items()}

    def load(self, saved):
        """Back to a saved state."""
        self.q, self.memory = saved[0].copy(), {k: m.copy() for k, m in saved[1].items()}
        for k, at in saved[2].items():
            self.faces[k].at = at

    def nodes(self, q=None):
        """Node positions (n, 3)."""
        q = self.q if q is None else q
        return self.mesh.nodes + (self.elastic.t @ q).reshape(-1, 3)

    def answers(self, q):
        """Contact of each face at q."""
        x = (self.x_rest + self.jacobian @ q).reshape(-1, 3)
        return x, {
            k: contact.respond(f, self.memory[k], x, self.area, self.cell, self.c_modulus, self.mu[k]) for k, f in self.faces.items()
        }

    def residual(self, q):
        """Unbalanced force in q, and what the tangent needs."""
        force, st = self.elastic.force(self.nodes(q))
        x, answers = self.answers(q)
        push = np.zeros((len(self.area), 3))
        for a in answers.values():
            push[a["idx"]] += a["force"]
        push *= self.share[:, None]
        return force - self.weight - self.jacobian.T @ push.ravel(), st, x, answers

    def tangent(self, st, answers, exact=True):
        """Derivative of the residual."""
        n = len(self.area)
        slope = np.zeros((n, 3, 3))
        for a in answers.values():
            slope[a["idx"]] += a["slope"]
        idx = np.where(np.any(slope != 0, axis=(1, 2)))[0]
        rows = (3 * idx[:, None] + np.arange(3)).ravel()
        j = self.jacobian[rows]
        d = sp.bsr_matrix(
            (slope[idx] * self.share[idx, None, None], np.arange(len(idx)), np.arange(len(idx) + 1)), (3 * len(idx), 3 * len(idx))
        )
        return self.elastic.tangent(st, exact) + (j.T @ (d @ j)).tocsc()

    def solve(self, most=40):
        """Newton to `TOLERANCE`; commits the friction history. Raises NotConverged and leaves the state as it was."""
        q = self.q.copy()
        r, st, x, answers = self.residual(q)
        norm = np.linalg.norm(r)
        for _ in range(most):
            if norm < TOLERANCE:
                break
            dq = -factor(self.tangent(st, answers)).solve(r)
            step, best = 1.0, None
            while step > 0.02:
                trial = self.residual(q + step * dq)
                size = np.linalg.norm(trial[0])
                if np.isfinite(size) and (best is None or size < best[0]):
                    best = (size, step, trial)
                if np.isfinite(size) and size < norm:
                    break
                step /= 2
            if best is None or not np.abs(dq).max() < 0.1:
                raise NotConverged
            norm, step, (r, st, x, answers) = best
            q = q + step * dq
            self.iterations += 1
        if norm >= TOLERANCE:
            raise NotConverged
        self.q = q
        self.steps += 1
        for k, f in self.faces.items():
            contact.commit(f, self.memory[k], x, answers[k])
        return answers

    def totals(self, answers, name):
        """Force on the body from a face (N), share of its touching samples that slip, and utilisation of friction."""
        a = answers[name]
        share = self.share[a["idx"]]
        total = (a["force"] * share[:, None]).sum(0)
        normal = float((a["fn"] * share).sum())
        slipping = float((a["slip"] * share).sum() / share.sum()) if len(share) else 0.0
        return dict(force=total, normal=normal, slipping=slipping)
