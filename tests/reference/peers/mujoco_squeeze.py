"""The squeeze with a flex of MuJoCo on the CPU (pip install mujoco==4.0.0)."""

import sys
from argparse import ArgumentParser, Namespace

import mujoco
import numpy as np

from scene import BETA, FRICTION, GRAVITY, PAD_EDGE, PAD_THICKNESS, POISSON, Squeeze, arguments, measure

CONTACT = f'condim="3" friction="{FRICTION} 0 0" solref="0.004 1" solimp="0.99 0.999 0.0001"'
# Stiffness of the drives of the pads, N/m.
DRIVE = 1e5


def flags(about: str, dt: float, tolerance: float) -> ArgumentParser:
    """Adds those of MuJoCo's solver."""
    parser = arguments(about, dt)
    parser.add_argument("--solver", default="CG", choices=["CG", "Newton"])
    parser.add_argument("--iterations", type=int, default=50, help="largest number per step")
    parser.add_argument("--impratio", type=float, default=10.0)
    parser.add_argument("--tolerance", type=float, default=tolerance)
    return parser


def numbers(array: np.ndarray) -> str:
    return " ".join(f"{x:.9g}" for x in array.ravel())


def pad(name: str, side: int) -> str:
    """A pad on drives along z and outwards along x. Mocap bodies would have no velocity in friction."""
    half = PAD_THICKNESS / 2
    return f"""<body name="{name}" pos="0 0 0.025" gravcomp="1">
      <joint name="{name}z" type="slide" axis="0 0 1"/><joint name="{name}x" type="slide" axis="{side} 0 0"/>
      <geom type="box" size="{half} {PAD_EDGE / 2} {PAD_EDGE / 2}" pos="{side * half} 0 0" mass="1" {CONTACT}/></body>"""


def load(cube: Squeeze, options: Namespace) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The scene with open pads."""
    drives = "".join(f'<position joint="{name}" kp="{DRIVE}" kv="{0.02 * DRIVE}"/>' for name in ("leftz", "leftx", "rightz", "rightx"))
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <compiler autolimits="true"/>
  <option timestep="{options.dt}" integrator="discrete" solver="{options.solver}" iterations="{options.iterations}"
          tolerance="{options.tolerance}" cone="elliptic" impratio="{options.impratio}" gravity="0 0 -{GRAVITY}"/>
  <size memory="400M"/>
  <worldbody>
    <geom type="plane" size="1 1 0.1" {CONTACT}/>
    {pad("left", -1)}
    {pad("right", 1)}
    <flexcomp name="cube" type="direct" dim="3" mass="{cube.density * cube.volumes.sum()}" radius="0"
              point="{numbers(cube.nodes)}" element="{numbers(cube.tets)}">
      <contact selfcollide="none" {CONTACT}/>
      <elasticity young="{cube.youngs}" poisson="{POISSON}" damping="{BETA}"/>
    </flexcomp>
  </worldbody>
  <actuator>{drives}</actuator>
</mujoco>""")
    data = mujoco.MjData(model)
    for name in ("leftx", "rightx"):
        data.joint(name).qpos[0] = cube.open
    data.ctrl[:] = [0, cube.open] * 2
    mujoco.mj_forward(model, data)
    return model, data


class Flex:
    """One world on the CPU."""

    def __init__(self, cube: Squeeze, options: Namespace):
        self.cube, self.dt, self.steps = cube, options.dt, 0
        self.model, self.data = load(cube, options)

    def advance(self) -> None:
        face, rise = self.cube.pads(self.data.time + self.dt)
        self.data.ctrl[:] = [rise, face] * 2
        mujoco.mj_step(self.model, self.data)
        self.steps += 1

    def wait(self) -> None:
        pass

    def positions(self) -> np.ndarray:
        return self.data.flexvert_xpos.reshape(1, -1, 3).copy()

    def forces(self) -> np.ndarray:
        return np.abs(self.data.actuator_force[[1, 3]]).mean(keepdims=True)


if __name__ == "__main__":
    # In place of MUJOCO_LOG.TXT.
    mujoco.set_mju_user_warning(lambda text: print(text, file=sys.stderr))
    options = flags(__doc__, dt=0.0166666667, tolerance=1e-6).parse_args()
    for gap in options.gap_mm:
        cube = Squeeze(1e-3 * gap, options)
        measure(Flex(cube, options), cube, {"peer": "mujoco", "version": mujoco.__version__})
