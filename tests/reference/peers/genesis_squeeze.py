"""The squeeze with Genesis: implicit FEM and its SAP coupler, on the CPU (pip install torch genesis-world==1.4.5)."""

import tempfile
from argparse import Namespace
from pathlib import Path

import genesis as gs
import genesis.utils.element
import numpy as np

from scene import BETA, EDGE, FRICTION, GRAVITY, PAD_EDGE, PAD_THICKNESS, POISSON, Squeeze, arguments, measure

# Stiffness of the drives of the pads, N/m.
DRIVE = 1e5


def pad(name: str, side: int) -> str:
    """A pad on drives along z and outwards along x."""
    size = f"{PAD_THICKNESS / 2} {PAD_EDGE / 2} {PAD_EDGE / 2}"
    return f"""<body name="{name}" pos="{side * PAD_THICKNESS / 2} 0 {EDGE / 2}"><joint name="{name}z" type="slide" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <body name="{name}face"><joint name="{name}x" type="slide" axis="{side} 0 0"/>
      <geom type="box" size="{size}" mass="1" friction="{FRICTION} 0 0"/></body></body>"""


class Fem:
    """Worlds of one scene."""

    def __init__(self, cube: Squeeze, worlds: int, options: Namespace):
        self.cube, self.dt, self.steps, self.worlds = cube, options.dt, 0, worlds
        # The mesh of the other peers in place of Genesis's own.
        genesis.utils.element.mesh_to_elements = lambda *_, **__: (cube.nodes.copy(), cube.tets.copy())
        genesis.utils.element.split_all_surface_tets = lambda nodes, tets: (nodes, tets)
        self.scene = gs.Scene(
            sim_options=gs.options.SimOptions(dt=self.dt, substeps=1, gravity=(0, 0, -GRAVITY)),
            fem_options=gs.options.FEMOptions(
                use_implicit_solver=True,
                n_newton_iterations=1,
                damping_alpha=0.0,
                damping_beta=BETA,
                n_pcg_iterations=500,
                pcg_threshold=1e-8,
            ),
            coupler_options=gs.options.SAPCouplerOptions(
                n_sap_iterations=5,
                enable_fem_self_tet_contact=False,
                hydroelastic_stiffness=options.hydroelastic_pa,
                point_contact_stiffness=options.hydroelastic_pa,
                sap_taud=0.1,
                rigid_floor_contact_type="none",
                rigid_rigid_contact_type="none",
            ),
            show_viewer=False,
        )
        rigid = {"coup_friction": FRICTION}
        self.scene.add_entity(gs.morphs.Plane(), material=gs.materials.Rigid(**rigid))
        with tempfile.TemporaryDirectory() as folder:
            pads = Path(folder) / "pads.xml"
            pads.write_text(f"<mujoco><worldbody>{pad('left', -1)}{pad('right', 1)}</worldbody></mujoco>")
            material = gs.materials.Rigid(gravity_compensation=1.0, **rigid)
            self.pads = self.scene.add_entity(gs.morphs.MJCF(file=str(pads)), material=material)
            material = gs.materials.FEM.Elastic(
                E=cube.youngs,
                nu=POISSON,
                rho=cube.density,
                friction_mu=FRICTION,
                model="linear_corotated",
                hydroelastic_modulus=options.hydroelastic_pa,
            )
            self.body = self.scene.add_entity(gs.morphs.Box(size=(EDGE,) * 3, pos=(0, 0, 0)), material=material)
            self.scene.build(n_envs=worlds)
        joints = [joint for joint in self.pads.joints if joint.n_dofs]
        self.names = [joint.name for joint in joints]
        self.dofs = [joint.dofs_idx_local[0] for joint in joints]
        each = np.ones(len(self.dofs))
        self.pads.set_dofs_kp(DRIVE * each, self.dofs)
        self.pads.set_dofs_kv(0.02 * DRIVE * each, self.dofs)
        self.pads.set_dofs_force_range(-1e6 * each, 1e6 * each, self.dofs)
        self.pads.set_dofs_position(self.targets(0.0), self.dofs)

    def targets(self, at: float) -> np.ndarray:
        face, rise = self.cube.pads(at)
        return np.tile([rise if name.endswith("z") else face for name in self.names], (self.worlds, 1))

    def advance(self) -> None:
        self.pads.control_dofs_position(self.targets((self.steps + 1) * self.dt), self.dofs)
        self.scene.step()
        self.steps += 1

    def wait(self) -> None:
        pass

    def positions(self) -> np.ndarray:
        return self.body.get_state().pos.detach().cpu().numpy().reshape(self.worlds, -1, 3).astype(float)

    def forces(self) -> np.ndarray:
        sideways = [index for index, name in enumerate(self.names) if name.endswith("x")]
        forces = self.pads.get_dofs_control_force(self.dofs).cpu().numpy().reshape(self.worlds, -1)
        return np.abs(forces[:, sideways]).mean(1)


if __name__ == "__main__":
    parser = arguments(__doc__, dt=8e-3)
    parser.add_argument("--worlds", type=int, nargs="+", default=[1], help="one row each")
    parser.add_argument("--hydroelastic-pa", type=float, default=1e7, help="stiffness of contact")
    options = parser.parse_args()
    gs.init(backend=gs.cpu, precision="64", logging_level="warning")
    for worlds in options.worlds:
        for gap in options.gap_mm:
            cube = Squeeze(1e-3 * gap, options)
            measure(Fem(cube, worlds, options), cube, {"peer": "genesis", "version": gs.__version__})
