"""States and actions as numbers: rotation vectors on one side, and standardisation."""

from dataclasses import dataclass

import numpy as np

# Columns of a state and of an action that hold the rotation vector, the column of the gripper, and that of the commanded closure,
# which only some states have.
ROTATION, GRIPPER, CLOSURE = slice(3, 6), 6, 7
# Differences of positions (m), rotation vectors (rad) and closures that are told apart well by a policy with memory: a hand that feels
# closes by as little as 0.02 mm (1/4000 of the closure) per step.
FINE = np.float32([5e-5] * 3 + [1e-3] * 3 + [2.5e-4])
# The same of the mean motion of the markers of a finger along x and y (px) and of their divergence.
FINE_READINGS = np.float32([0.01, 0.01, 3e-4] * 2)
# Position of an open finger, m.
OPEN = 0.04


def mean_axis(rotations: np.ndarray) -> np.ndarray:
    """The direction on whose side most rotation vectors (N, 3) are, up to its sign: their first principal axis."""
    _, vectors = np.linalg.eigh(rotations.T @ rotations)
    return vectors[:, -1].astype(np.float32)


def fold(rows: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Writes the rotation vectors of rows (…, 7 or 8) on the side of `axis`.

    A rotation by θ about n is one by 2π − θ about −n. The tool points down, so θ is near π, and nearly equal rotations can
    have opposite vectors.
    """
    folded = rows.copy()
    vectors = folded[..., ROTATION]
    angle = np.linalg.norm(vectors, axis=-1, keepdims=True)
    opposite = vectors * (1 - 2 * np.pi / np.maximum(angle, 1e-6))
    is_other_side = (vectors @ axis < 0)[..., None]
    folded[..., ROTATION] = np.where(is_other_side, opposite, vectors)
    return folded


def reference(states, is_relative: bool):
    """What is subtracted from the actions (…, 7) that follow on states (…, 7 or 8), arrays or tensors: the pose of the tool, and
    the commanded closure if the answer is relative to it, else 0."""
    found = states[..., [0, 1, 2, 3, 4, 5, CLOSURE if is_relative else GRIPPER]]
    if not is_relative:
        found[..., GRIPPER] = 0
    return found


def fine(changes, scale):
    """Changes on a scale that is linear below `scale` and logarithmic above, so that the small ones of a grip and the large ones of the
    arm are equally well resolved. `coarse` is the inverse."""
    return np.arcsinh(changes / scale) if isinstance(changes, np.ndarray) else (changes / scale).asinh()


def coarse(numbers, scale):
    return (np.sinh(numbers) if isinstance(numbers, np.ndarray) else numbers.sinh()) * scale


def turns(rotations: np.ndarray) -> np.ndarray:
    """Rotation matrices (…, 3, 3) of rotation vectors (…, 3): their columns are the axes of the tool."""
    angle = np.maximum(np.linalg.norm(rotations, axis=-1), 1e-9)[..., None, None]
    x, y, z = np.moveaxis(rotations, -1, 0) / angle[..., 0, 0]
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*x.shape, 3, 3)
    return (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)).astype(rotations.dtype)


def _vector(matrix: np.ndarray) -> np.ndarray:
    """The rotation vector (3,) of a rotation matrix, by its quaternion, which is exact near half a turn as well."""
    trace = np.array([matrix.trace(), *matrix.diagonal()])
    largest = int(trace.argmax())
    if largest == 0:
        x, y, z = matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]
        quaternion = np.array([1 + trace[0], x, y, z])
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        quaternion = np.empty(4)
        quaternion[0] = matrix[k, j] - matrix[j, k]
        quaternion[1 + i] = 1 + matrix[i, i] - matrix[j, j] - matrix[k, k]
        quaternion[1 + j], quaternion[1 + k] = matrix[j, i] + matrix[i, j], matrix[k, i] + matrix[i, k]
    length = float(np.linalg.norm(quaternion[1:]))
    angle = 2 * np.arctan2(length, quaternion[0])
    return (angle if angle <= np.pi else angle - 2 * np.pi) * quaternion[1:] / max(length, 1e-300)


def between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The rotation vector (3,), in the base frame, that turns the rotation of one vector into that of another."""
    return _vector(turns(np.float64(second)) @ turns(np.float64(first)).T)


def rotated(rotation: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """The rotation vector (3,) after a turn in the base frame."""
    return _vector(turns(np.float64(turn)) @ turns(np.float64(rotation)))


def turned(changes, matrices):
    """Changes (…, n, 7) with their positions multiplied by matrices (…, 3, 3) from the right."""
    found = changes.copy() if isinstance(changes, np.ndarray) else changes.clone()
    found[..., :3] = changes[..., :3] @ matrices
    return found


def hand(states: np.ndarray) -> np.ndarray:
    """States (…, 7 or 8) in the units of commands (…, 7): the finger position as a closure."""
    found = states[..., :7].copy()
    found[..., GRIPPER] = np.clip(1 - found[..., GRIPPER] / OPEN, 0, 1)
    return found


@dataclass
class Standard:
    """Mean and standard deviation per component."""

    mean: np.ndarray
    std: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, least: np.ndarray | float = 0.0) -> "Standard":
        """Those of rows (N, D), the deviations at least `least`. Without it, a component that never changes has the deviation 1."""
        std = np.maximum(rows.std(axis=0), least)
        std = np.where(std < 1e-6, 1, std)
        return cls(rows.mean(axis=0).astype(np.float32), std.astype(np.float32))

    @classmethod
    def of_each(cls, sets: list[np.ndarray], least: np.ndarray | float) -> "Standard":
        """Those of each of some sets of rows."""
        found = [cls.of(rows, least) for rows in sets]
        return cls(np.stack([one.mean for one in found]), np.stack([one.std for one in found]))

    def apply(self, rows: np.ndarray) -> np.ndarray:
        return (rows - self.mean) / self.std

    def invert(self, rows: np.ndarray) -> np.ndarray:
        return rows * self.std + self.mean
