"""The squeeze of scripts/squeeze.lua for other simulators: mesh, motion of the pads, measures and rows (SI units).

x is the axis of the squeeze; the cube rests on a table at z = 0. A peer simulates one or more worlds of it at the same time.
"""

import argparse
import hashlib
import json
import time
from typing import Protocol

import numpy as np

EDGE, NODES = 0.05, 7
POISSON, FRICTION, BETA, GRAVITY = 0.4, 1.2, 2e-3, 9.81
PAD_EDGE, PAD_THICKNESS = 22e-3, 10e-3
CLEARANCE, CLOSING, RISE = 2e-3, 0.04, 0.1
SETTLE, GRIP, LIFT = 0.1, 0.25, 1.0
# Tetrahedra of the voxels of a checkerboard: edges of neighbours coincide, and the mesh is symmetric.
EVEN = [(0, 1, 2, 5), (0, 2, 3, 7), (0, 5, 7, 4), (2, 7, 5, 6), (0, 2, 7, 5)]
ODD = [(1, 2, 3, 6), (1, 3, 0, 4), (1, 6, 4, 5), (3, 4, 6, 7), (1, 3, 4, 6)]


class Peer(Protocol):
    """A simulator with the cube loaded."""

    dt: float
    steps: int
    """Steps made so far."""

    def advance(self) -> None:
        """Makes one or more steps. They may still run on a device when it returns."""

    def wait(self) -> None:
        """Waits for the device."""

    def positions(self) -> np.ndarray:
        """Positions of the nodes: worlds × nodes × 3."""

    def forces(self) -> np.ndarray:
        """Force along x per world, the mean of both pads. It may make steps."""


def arguments(about: str, dt: float) -> argparse.ArgumentParser:
    """The flags of all peers. `dt` is the default time step, s."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--gap-mm", type=float, nargs="+", default=[42.0])
    parser.add_argument("--dt", type=float, default=dt, help="time step, s")
    parser.add_argument("--youngs-pa", type=float, default=3e4)
    parser.add_argument("--density", type=float, default=300.0)
    parser.add_argument("--hold-s", type=float, default=0.5)
    return parser


def batched(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    """Adds the flags of peers that simulate several worlds on a device."""
    parser.add_argument("--worlds", type=int, nargs="+", default=[1], help="one row each")
    parser.add_argument("--device", default="cuda:0")
    return parser


class Squeeze:
    """The scene at one gap of the closed pads."""

    def __init__(self, gap: float, options: argparse.Namespace):
        self.youngs, self.density = options.youngs_pa, options.density
        axis = np.linspace(-0.5 * EDGE, 0.5 * EDGE, NODES)
        z, y, x = np.meshgrid(axis + 0.5 * EDGE, axis, axis, indexing="ij")
        self.nodes = np.stack([x, y, z], -1).reshape(-1, 3)
        self.tets = tetrahedra()
        self.volumes = volumes(self.nodes, self.tets)
        inverted = self.volumes < 0
        self.tets[inverted] = self.tets[inverted][:, [0, 1, 3, 2]]
        self.volumes = np.abs(self.volumes)
        self.open, self.closed = 0.5 * EDGE + CLEARANCE, 0.5 * gap
        self.lift_at = SETTLE + (self.open - self.closed) / CLOSING + GRIP
        self.hold_at = self.lift_at + LIFT
        self.end = self.hold_at + options.hold_s

    def pads(self, at: float) -> tuple[float, float]:
        """Distance of the pads' inner faces from the centre plane, and their rise, at a time."""
        face = max(self.closed, self.open - CLOSING * max(0.0, at - SETTLE))
        u = min(max((at - self.lift_at) / LIFT, 0.0), 1.0)
        return face, RISE * u**3 * (10 - 15 * u + 6 * u * u)

    def height(self, positions: np.ndarray) -> np.ndarray:
        """Rise of the centre of mass per world."""
        masses = np.bincount(self.tets.ravel(), np.repeat(self.volumes, 4))
        return positions[:, :, 2] @ (masses / masses.sum()) - 0.5 * EDGE

    def deformation_pct(self, positions: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """RMS displacement from the rest shape after the best rigid fit, % of the diagonal, per world; the weights sum to 1."""
        rest = self.nodes - weights @ self.nodes
        now = positions - np.einsum("n,wni->wi", weights, positions)[:, None]
        u, _, vt = np.linalg.svd(np.einsum("n,ni,wnj->wij", weights, rest, now))
        u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
        squares = ((rest @ (u @ vt) - now) ** 2).sum(2)
        return 100 * np.sqrt(squares @ weights) / (EDGE * 3**0.5)


def tetrahedra() -> np.ndarray:
    """Five tetrahedra per voxel; nodes are numbered along x first."""
    tets = []
    for k, j, i in np.ndindex(NODES - 1, NODES - 1, NODES - 1):
        offsets = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        corners = [(i + a) + NODES * ((j + b) + NODES * (k + c)) for a, b, c in offsets]
        tets += [[corners[c] for c in tet] for tet in (ODD if (i + j + k) % 2 else EVEN)]
    return np.array(tets)


def volumes(positions: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Signed volumes of the tetrahedra."""
    a, b, c, d = (positions[..., tets[:, corner], :] for corner in range(4))
    return np.einsum("...i,...i", np.cross(b - a, c - a), d - a) / 6


def measure(peer: Peer, cube: Squeeze, row: dict) -> None:
    """Runs the squeeze and prints a row of measures and speed. The first call of `advance` counts as start, not as speed."""
    begin = time.perf_counter()
    peer.advance()
    peer.wait()
    first = time.perf_counter() - begin
    wall, cpu, simulated, seen = 0.0, 0.0, 0.0, []
    for until, with_force in ((cube.lift_at, True), (cube.hold_at + 0.2, False), (cube.end, True)):
        before, wall_before, cpu_before = peer.steps, time.perf_counter(), time.process_time()
        while (peer.steps + 0.5) * peer.dt < until:
            peer.advance()
        peer.wait()
        wall += time.perf_counter() - wall_before
        cpu += time.process_time() - cpu_before
        simulated += (peer.steps - before) * peer.dt
        at, positions = peer.steps * peer.dt, peer.positions()
        force = float(peer.forces().mean()) if with_force else None
        seen.append((at, positions, force))
    (_, gripped, force_grip), (held_at, held, _), (end, last, force_hold) = seen

    equal = np.full(NODES**3, NODES**-3.0)
    along = np.array([1.0] + [2.0] * (NODES - 2) + [1.0])
    by_mass = np.einsum("i,j,k->ijk", along, along, along).ravel()
    rise = cube.height(last)
    values = {
        "holds": int((rise > 0.8 * RISE).sum()),
        "force_grip_n": force_grip,
        "force_hold_n": force_hold,
        "d_grip_pct": cube.deformation_pct(gripped, equal).mean(),
        "d_hold_pct": cube.deformation_pct(last, equal).mean(),
        "d_hold_mass_pct": cube.deformation_pct(last, by_mass / by_mass.sum()).mean(),
        "slip_mm": 1e3 * (RISE - rise).mean(),
        "creep_mm_per_s": 1e3 * ((cube.height(held) - rise) / (end - held_at)).mean(),
        "min_volume_ratio": (volumes(last, cube.tets) / cube.volumes).min(),
        "worlds_differ_m": np.abs(last - last[0]).max(),
        "first_world": hashlib.sha256(last[0].tobytes()).hexdigest()[:12],
        "sim_s": simulated,
        "first_s": first,
        "wall_s": wall,
        "sim_per_wall": len(last) * simulated / wall,
        "cpu_per_sim_s": cpu / (len(last) * simulated),
    }
    row = row | {"gap_mm": 2e3 * cube.closed, "worlds": len(last), "dt": peer.dt} | values
    print(json.dumps({key: float(f"{x:.5g}") if isinstance(x, float) else x for key, x in row.items()}), flush=True)
