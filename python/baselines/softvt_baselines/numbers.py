"""States and actions as numbers: rotation vectors on one side, and standardisation."""

from dataclasses import dataclass

import numpy as np

# Columns of a state and of an action that hold the rotation vector, the column of the gripper, and that of the commanded closure,
# which only some states have.
ROTATION, GRIPPER, CLOSURE = slice(3, 6), 6, 7


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

    def apply(self, rows: np.ndarray) -> np.ndarray:
        return (rows - self.mean) / self.std

    def invert(self, rows: np.ndarray) -> np.ndarray:
        return rows * self.std + self.mean
