"""The two-pad squeeze: rest on the table, close the pads step by step, take the table away."""

import numpy as np

from . import mesh as meshes
from .contact import Face
from .measure import deformation
from .statics import NotConverged, Scene

BODIES = {
    "cube": lambda o: meshes.cube(o["size_m"]),
    "sphere": lambda o: meshes.sphere(o["radius_m"]),
    "capsule": lambda o: meshes.capsule(o["radius_m"], o["length_m"]),
    "cylinder": lambda o: meshes.cylinder(o["radius_m"], o["length_m"]),
}
STICK = 1e3


class Squeeze:
    """One body between two pads on a table, mirrored in x (one pad stands for both). Options: shape, size_m or radius_m (and length_m), youngs_pa, poisson,
    density, friction, resolution, pad_m, pad_offset_m (y, z), step_m of the gap, spacing_m of the samples."""

    def __init__(self, **options):
        o = self.o = (
            dict(
                youngs_pa=3e4,
                poisson=0.4,
                density=300.0,
                friction=1.2,
                resolution=6,
                pad_m=0.022,
                pad_offset_m=(0.0, 0.0),
                step_m=1e-4,
                spacing_m=0.75e-3,
            )
            | options
        )
        body = BODIES[o["shape"]](o)
        self.mesh = meshes.voxel_mesh(body, o["resolution"])
        self.product, self.diagonal = self.mesh.product(), float(np.linalg.norm(body.size))
        mirrors = {0: 0.0} | ({1: 0.0} if o["pad_offset_m"][0] == 0 else {})
        self.scene = Scene(self.mesh, body, o["youngs_pa"], o["poisson"], o["density"], mirrors, o["spacing_m"])
        self.width = float(body.bounds[1][0] - body.bounds[0][0])
        self.gap = self.width + 1e-4
        centre, half = (o["pad_offset_m"][0], self.width / 2 + o["pad_offset_m"][1]), o["pad_m"] / 2
        self.scene.add("table", Face(2, 1.0, 0.0), o["friction"])
        self.scene.add("pad", Face(0, 1.0, -self.gap / 2, centre, half), o["friction"])
        self._settle()

    def _settle(self):
        """Gravity, from a guess that just touches the table; anchors at the rest shape."""
        s = self.scene
        x0 = s.nodes()
        for depth in (1e-5, 3e-5, 1e-4, 3e-4):
            s.q = np.asarray(s.elastic.t.T @ np.tile([0, 0, -depth], len(x0)))
            s.q /= np.maximum(np.asarray(s.elastic.t.power(2).sum(0)).ravel(), 1.0)
            try:
                s.solve(200)
                return
            except NotConverged:
                continue
        raise NotConverged("settling")

    def close(self, gap):
        """Closes the pads to `gap` in steps of at most step_m, halved where Newton does not converge."""
        step = self.o["step_m"]
        while self.gap - gap > 1e-12:
            target = max(gap, self.gap - step)
            saved = self.scene.save()
            try:
                self.scene.faces["pad"].at = -target / 2
                self.answers = self.scene.solve()
                self.gap = target
                step = min(self.o["step_m"], 2 * step)
            except NotConverged:
                self.scene.load(saved)
                step /= 2
                if step < 1e-6:
                    raise

    def state(self):
        """Force per pad, deformation and so on of the present state; the mirror counts both pads, hence the halves."""
        s, x = self.scene, self.scene.nodes()
        pad, table = s.totals(self.answers, "pad"), s.totals(self.answers, "table")
        lumps = self.mesh.lumps
        real = self.mesh.fill[s.elastic.reps] >= 0.2
        det = s.elastic.batch.min_det(x[s.elastic.corners])
        return dict(
            force_n=pad["normal"] / 2,
            friction_z_n=float(pad["force"][2]) / 2,
            table_n=float(table["force"][2]),
            d_pct=deformation(self.mesh.nodes, x),
            d_volume_pct=deformation(self.mesh.nodes, x, self.product, self.diagonal),
            min_det_f=float(det[real].min()),
            slipping=pad["slipping"],
            centre_z_m=float(lumps @ x[:, 2] / lumps.sum()),
        )

    def lift(self, mu, most=8e-3):
        """Lowers the table until it carries nothing; None if the body slides down with it (nothing holds it)."""
        s, saved, gap_answers = self.scene, self.scene.save(), self.answers
        keep, s.mu["pad"] = s.mu["pad"], mu
        step, down, held = 2e-5, 0.0, None
        try:
            while down < most:
                before = s.save()
                try:
                    s.faces["table"].at = -(down + step)
                    self.answers = s.solve()
                except NotConverged:
                    s.load(before)
                    step /= 2
                    if step < 1e-6:
                        break
                    continue
                down += step
                step = min(1.5 * step, 2e-4)
                now = self.state()
                if now["table_n"] == 0.0:
                    held = now
                    break
                if now["slipping"] == 1.0:
                    break
        finally:
            s.mu["pad"] = keep
            s.load(saved)
            self.answers = gap_answers
        return held

    def row(self, gap, lift=True):
        """The row of one gap (m): grip and hold, and whether friction holds it."""
        self.close(gap)
        grip = self.state()
        o, s = self.o, self.scene
        out = dict(
            test="squeeze",
            shape=o["shape"],
            resolution=o["resolution"],
            gap_mm=round(1e3 * gap, 4),
            pad_mm=round(1e3 * o["pad_m"], 4),
            pad_offset_mm=[round(1e3 * v, 4) for v in o["pad_offset_m"]],
            youngs_pa=o["youngs_pa"],
            poisson=o["poisson"],
            density=o["density"],
            friction=o["friction"],
            nodes=len(self.mesh.nodes),
            elements=len(self.mesh.elements),
            weight_n=s.weight_n,
            diagonal_nodes_mm=1e3 * self.mesh.diagonal(),
            diagonal_skin_mm=1e3 * self.diagonal,
        )
        out |= {f"{k}_m": o[f"{k}_m"] for k in ("size", "radius", "length") if f"{k}_m" in o}
        out |= dict(
            force_grip_n=grip["force_n"],
            d_grip_pct=grip["d_pct"],
            d_grip_volume_pct=grip["d_volume_pct"],
            min_det_f_grip=grip["min_det_f"],
            slipping_grip=grip["slipping"],
            table_grip_n=grip["table_n"],
        )
        if not lift:
            return out
        hold = self.lift(o["friction"])
        stick = hold or self.lift(STICK)
        out |= dict(holds=hold is not None, hold_branch="coulomb" if hold else "stick")
        if stick:
            out |= dict(
                force_hold_n=stick["force_n"],
                d_hold_pct=stick["d_pct"],
                d_hold_volume_pct=stick["d_volume_pct"],
                min_det_f_hold=stick["min_det_f"],
                slipping_hold=stick["slipping"],
                sag_mm=1e3 * (grip["centre_z_m"] - stick["centre_z_m"]),
                capacity_over_weight=2 * o["friction"] * stick["force_n"] / s.weight_n,
            )
        return out
