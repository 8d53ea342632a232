"""The squeeze with flexes of MuJoCo-Warp (pip install mujoco==4.0.0 mujoco-warp==4.0.0 warp-lang==1.19.0)."""

from argparse import Namespace

import mujoco_squeeze
import mujoco_warp
import numpy as np
import warp as wp
from warp_pads import face_and_rise

from scene import Squeeze, batched, measure

# Steps per CUDA graph.
STEPS = 5
CONTACTS, CONSTRAINTS = 160, 512  # room per world


@wp.kernel
def drive(time: wp.array[float], dt: float, cube: wp.vec3, ctrl: wp.array2d[float]):
    world = wp.tid()
    pads = face_and_rise(time[world] + dt, cube)
    for side in range(2):
        ctrl[world, 2 * side] = pads[1]
        ctrl[world, 2 * side + 1] = pads[0]


class Flexes:
    """Worlds on a device."""

    def __init__(self, cube: Squeeze, worlds: int, options: Namespace):
        self.dt, self.steps, self.worlds = options.dt, 0, worlds
        self.cube = wp.vec3(cube.open, cube.closed, cube.lift_at)
        model, data = mujoco_squeeze.load(cube, options)
        self.model = mujoco_warp.put_model(model)
        self.model.opt.warn_overflow = 0
        self.data = mujoco_warp.put_data(model, data, nworld=worlds, nconmax=CONTACTS, njmax=CONSTRAINTS)
        self.graph = None

    def make(self) -> None:
        for _ in range(STEPS):
            wp.launch(drive, dim=self.worlds, inputs=[self.data.time, self.dt, self.cube], outputs=[self.data.ctrl])
            mujoco_warp.step(self.model, self.data)

    def advance(self) -> None:
        if self.graph is not None:
            wp.capture_launch(self.graph)
        else:
            self.make()
            if wp.get_device().is_cuda:
                with wp.ScopedCapture() as capture:
                    self.make()
                self.graph = capture.graph
        self.steps += STEPS

    def wait(self) -> None:
        wp.synchronize()

    def positions(self) -> np.ndarray:
        return self.data.flexvert_xpos.numpy().reshape(self.worlds, -1, 3).astype(float)

    def forces(self) -> np.ndarray:
        return np.abs(self.data.actuator_force.numpy()[:, [1, 3]]).mean(1)


if __name__ == "__main__":
    wp.config.quiet = True
    options = batched(mujoco_squeeze.flags(__doc__, dt=0.0125, tolerance=1e-5)).parse_args()
    with wp.ScopedDevice(options.device):
        for worlds in options.worlds:
            for gap in options.gap_mm:
                cube = Squeeze(1e-3 * gap, options)
                measure(Flexes(cube, worlds, options), cube, {"peer": "mujoco-warp", "version": mujoco_warp.__version__})
