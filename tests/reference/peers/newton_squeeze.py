"""The squeeze with Newton's VBD solver (pip install newton==1.8.0 warp-lang==1.19.0)."""

from argparse import Namespace

import newton
import numpy as np
import warp as wp
from warp_pads import face_and_rise

from scene import (
    CLOSING,
    EDGE,
    FRICTION,
    GRAVITY,
    LIFT,
    PAD_EDGE,
    PAD_THICKNESS,
    POISSON,
    RISE,
    SETTLE,
    Squeeze,
    arguments,
    batched,
    measure,
)

# Steps per CUDA graph: even, as the two states take turns.
STEPS = 10
# Radius of particles and distance at which contacts are found, m; stiffness of contact, N/m; damping of contact and material.
RADIUS, MARGIN, STIFFNESS, CONTACT_DAMPING, DAMPING = 1e-3, 4e-3, 1e4, 1e-2, 20.0


@wp.kernel
def move(
    time: wp.array[float],
    ahead: float,
    dt: float,
    cube: wp.vec3,
    pose: wp.array[wp.transform],
    velocity: wp.array[wp.spatial_vector],
):
    """Moves the pads, of which two are in each world. Particles are spheres around the nodes."""
    pad = wp.tid()
    side = 2.0 * float(pad % 2) - 1.0
    at = time[0] + ahead
    pads = face_and_rise(at, cube)
    inwards = 0.0
    if at > SETTLE and at <= SETTLE + (cube[0] - cube[1]) / CLOSING + 0.5 * dt:
        inwards = CLOSING
    u = wp.clamp((at - cube[2]) / LIFT, 0.0, 1.0)
    upwards = RISE * 30.0 * u * u * (1.0 - u) * (1.0 - u) / LIFT
    x, z = pads[0] + 0.5 * PAD_THICKNESS + RADIUS, pads[1] + 0.5 * EDGE + RADIUS
    pose[pad] = wp.transform(wp.vec3(side * x, 0.0, z), wp.quat_identity())
    velocity[pad] = wp.spatial_vector(-side * inwards, 0.0, upwards, 0.0, 0.0, 0.0)


@wp.kernel
def tick(time: wp.array[float], by: float):
    time[0] = time[0] + by


@wp.kernel
def add_forces(
    contacts: wp.array[int],
    shape: wp.array[int],
    force: wp.array[wp.spatial_vector],
    first: int,
    body: wp.array[int],
    sums: wp.array[float],
):
    contact = wp.tid()
    if contact < contacts[0]:
        pad = body[shape[contact]]
        if pad >= 0:
            wp.atomic_add(sums, pad, wp.abs(wp.spatial_top(force[first + contact])[0]))


class Worlds:
    """Worlds on a device."""

    def __init__(self, cube: Squeeze, worlds: int, options: Namespace):
        self.dt, self.steps, self.worlds = options.dt, 0, worlds
        self.cube = wp.vec3(cube.open, cube.closed, cube.lift_at)
        self.model = build(cube, worlds)
        self.pipeline = newton.CollisionPipeline(self.model, soft_contact_gap=MARGIN, enable_rigid_soft_full_surface_contact=False)
        self.contacts = self.pipeline.contacts()
        self.solver = newton.solvers.SolverVBD(
            self.model,
            iterations=options.iterations,
            integrate_with_external_rigid_solver=True,
            particle_enable_self_contact=False,
            friction_epsilon=options.friction_epsilon,
        )
        kinds = {newton.solvers.SolverBase.ObservableKind.CONTACT_F}
        self.observed = self.solver.observables(kinds, contacts=self.contacts)
        self.states = [self.model.state(), self.model.state()]
        self.control, self.time, self.graph = self.model.control(), wp.zeros(1, dtype=float), None

    def make(self, steps: int, observed=None) -> None:
        for step in range(steps):
            for state, ahead in zip(self.states, (step, step + 1)):
                inputs = [self.time, ahead * self.dt, self.dt, self.cube]
                wp.launch(move, dim=2 * self.worlds, inputs=inputs, outputs=[state.body_q, state.body_qd])
                state.clear_forces()
            self.pipeline.collide(self.states[0], self.contacts)
            self.solver.step(*self.states, self.control, self.contacts, self.dt, observables=observed)
            self.states.reverse()
        wp.launch(tick, dim=1, inputs=[self.time, steps * self.dt])

    def advance(self) -> None:
        if self.graph is not None:
            wp.capture_launch(self.graph)
        else:
            self.make(STEPS)
            if wp.get_device().is_cuda:
                with wp.ScopedCapture() as capture:
                    self.make(STEPS)
                self.graph = capture.graph
        self.steps += STEPS

    def wait(self) -> None:
        wp.synchronize()

    def positions(self) -> np.ndarray:
        return self.states[0].particle_q.numpy().reshape(self.worlds, -1, 3).astype(float) - np.array([0, 0, RADIUS])

    def forces(self) -> np.ndarray:
        """Makes a step with forces, and one without, after which the states have the order of the graph again."""
        self.make(1, self.observed)
        contacts, sums = self.contacts, wp.zeros(2 * self.worlds, dtype=float)
        inputs = [contacts.soft_contact_count, contacts.soft_contact_shape, self.observed.contact_f]
        inputs += [contacts.rigid_contact_max, self.model.shape_body]
        wp.launch(add_forces, dim=contacts.soft_contact_max, inputs=inputs, outputs=[sums])
        self.make(1)
        self.steps += 2
        return sums.numpy().reshape(self.worlds, 2).mean(1)


def build(cube: Squeeze, worlds: int) -> newton.Model:
    """The scene with open pads, once per world."""
    one = newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
    surface = newton.ModelBuilder.ShapeConfig(density=0.0, mu=FRICTION, ke=STIFFNESS, kd=CONTACT_DAMPING)
    for side in (-1, 1):
        at = wp.vec3(side * (cube.open + 0.5 * PAD_THICKNESS + RADIUS), 0.0, 0.5 * EDGE + RADIUS)
        pad = one.add_body(xform=wp.transform(at, wp.quat_identity()), mass=1.0, is_kinematic=True)
        one.add_shape_box(pad, hx=0.5 * PAD_THICKNESS, hy=0.5 * PAD_EDGE, hz=0.5 * PAD_EDGE, cfg=surface)
    below = wp.transform(wp.vec3(0.0, 0.0, -0.05), wp.quat_identity())
    one.add_shape_box(-1, xform=below, hx=0.5, hy=0.5, hz=0.05, cfg=surface)
    one.add_soft_mesh(
        pos=wp.vec3(0.0, 0.0, RADIUS),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0, 0.0, 0.0),
        vertices=[wp.vec3(*node) for node in cube.nodes.tolist()],
        indices=cube.tets.ravel().tolist(),
        density=cube.density,
        k_mu=cube.youngs / (2 * (1 + POISSON)),
        k_lambda=cube.youngs * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)),
        k_damp=DAMPING,
        particle_radius=RADIUS,
    )
    one.color()
    scene = newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
    scene.replicate(one, worlds)
    model = scene.finalize()
    model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = STIFFNESS, CONTACT_DAMPING, FRICTION
    return model


if __name__ == "__main__":
    wp.config.quiet = True
    parser = batched(arguments(__doc__, dt=1 / 600))
    parser.add_argument("--iterations", type=int, default=5, help="per step")
    parser.add_argument("--friction-epsilon", type=float, default=1e-3)
    options = parser.parse_args()
    with wp.ScopedDevice(options.device):
        for worlds in options.worlds:
            for gap in options.gap_mm:
                cube = Squeeze(1e-3 * gap, options)
                measure(Worlds(cube, worlds, options), cube, {"peer": "newton", "version": newton.__version__})
