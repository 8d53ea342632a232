"""Rigid discs and balls on an elastic layer (4 mm, shear modulus 0.145 MPa, Poisson's ratio 0.475) bonded to a rigid base.

Prints the stiffness of frictionless normal contact, of sideways motion and of twist of stuck discs, and the force on balls
by the radius of their contact, from which the stick radius under shear follows (Ciavarella, Int. J. Solids Structures 35
(1998) 2349: what a shear Q leaves to stick is the contact under the force P - Q/mu). Collocation on two square grids by
conjugate gradients and Fourier transforms, extrapolated to fine ones.

usage: python tests/reference/layer.py   (needs numpy; 15 s)
"""

import numpy as np

MU, NU, H = 0.145e6, 0.475, 4e-3
CELLS = 2e-4, 1e-4


def response(k):
    """Normal, longitudinal and transverse displacement by traction at wave number k, m/Pa."""
    a, kappa = np.minimum(k * H, 20.0), 3 - 4 * NU
    c, s = np.cosh(2 * a), np.sinh(2 * a)
    d = 2 * kappa * c + 4 * a * a + 1 + kappa * kappa
    scale = (1 - NU) / (MU * k)
    return scale * (2 * kappa * s - 4 * a) / d, scale * (2 * kappa * s + 4 * a) / d, np.tanh(a) / (MU * k)


class Disc:
    """The cells of a grid within a radius, and the displacement of their centres by tractions on them."""

    def __init__(self, radius, cell):
        self.n = int(2 ** np.ceil(np.log2((2 * radius + 24e-3) / cell)))
        self.cell = cell
        f = 2 * np.pi * np.fft.fftfreq(self.n, cell)
        kx, ky = np.meshgrid(f, f, indexing="ij")
        k = np.maximum(np.hypot(kx, ky), 1e-3)
        self.normal, along, across = response(k)
        x, y = kx / k, ky / k
        self.shear = across + (along - across) * x * x, (along - across) * x * y, across + (along - across) * y * y
        at = (np.arange(self.n) - self.n // 2) * cell
        self.x, self.y = np.meshgrid(at, at, indexing="ij")
        self.inside = np.hypot(self.x, self.y) < radius
        self.x, self.y = self.x[self.inside], self.y[self.inside]

    def _spectrum(self, values):
        grid = np.zeros((self.n, self.n))
        grid[self.inside] = values
        return np.fft.fft2(grid)

    def _field(self, spectrum):
        return np.fft.ifft2(spectrum).real[self.inside]

    def sink(self, pressure):
        return self._field(self._spectrum(pressure) * self.normal)

    def move(self, tractions):
        x, y = map(self._spectrum, tractions.reshape(2, -1))
        xx, xy, yy = self.shear
        return np.concatenate([self._field(xx * x + xy * y), self._field(xy * x + yy * y)])


def solved(apply, wanted):
    """Tractions that displace the cells as wanted."""
    t = np.zeros_like(wanted)
    r = wanted - apply(t)
    d = r.copy()
    while np.linalg.norm(r) > 1e-5 * np.linalg.norm(wanted):
        moved = apply(d)
        step = r @ r / (d @ moved)
        t += step * d
        new = r - step * moved
        d = new + new @ new / (r @ r) * d
        r = new
    return t


def stiffness(radius, cell):
    disc = Disc(radius, cell)
    one, none = np.ones_like(disc.x), np.zeros_like(disc.x)
    along, turn = np.concatenate([one, none]), np.concatenate([-disc.y, disc.x])
    forces = [solved(disc.sink, one).sum(), solved(disc.move, along) @ along, solved(disc.move, turn) @ turn]
    return np.array(forces) * cell**2


def ball(radius, contact, cell):
    """Force on a ball whose contact has this radius: the depth is the one at which the pressure ends there at zero."""
    disc = Disc(contact, cell)
    r = np.hypot(disc.x, disc.y)
    flat, bowl = solved(disc.sink, np.ones_like(r)), solved(disc.sink, r * r / (2 * radius))
    rim = r > contact - 2 * cell
    return (bowl[rim].sum() / flat[rim].sum() * flat - bowl).sum() * cell**2


def extrapolated(of, *args):
    coarse, fine = (of(*args, cell) for cell in CELLS)
    return 2 * fine - coarse


if __name__ == "__main__":
    for disc in 2e-3, 3e-3, 4e-3, 6e-3, 8e-3:
        normal, sideways, twist = extrapolated(stiffness, disc)
        found = f"{normal:.4g} N/m, sideways {sideways:.4g} N/m, twist {twist:.3g} N m/rad"
        print(f"disc of {1e3 * disc:g} mm: {found}", flush=True)
    for of_ball in 0.01, 0.02, 0.04:
        forces = [f"{extrapolated(ball, of_ball, contact):.4g}" for contact in np.arange(1e-3, 5.01e-3, 5e-4)]
        print(f"ball of {1e3 * of_ball:g} mm, contact of 1, 1.5 ... 5 mm: {', '.join(forces)} N", flush=True)
