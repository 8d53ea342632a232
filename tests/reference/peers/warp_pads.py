"""Motion of the pads in kernels of Warp."""

import warp as wp

from scene import CLOSING, LIFT, RISE, SETTLE


@wp.func
def face_and_rise(at: float, cube: wp.vec3) -> wp.vec2:
    """As `Squeeze.pads`; `cube` has the distances of the open and the closed pads, and the time of the lift."""
    face = wp.max(cube[1], cube[0] - CLOSING * wp.max(0.0, at - SETTLE))
    u = wp.clamp((at - cube[2]) / LIFT, 0.0, 1.0)
    return wp.vec2(face, RISE * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u))
