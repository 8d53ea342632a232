"""Phases of an episode, as its commands tell them: the way of a hand that sees, and the grip of one that feels."""

import numpy as np

from .numbers import GRIPPER

# Change of the command per step, m of the position or closing (0.6 mm), from which on a motion is fast. A hand that feels closes by at most
# 0.4 mm.
FAST, FAST_GRIP = 1e-3, 0.008
# Closing since the last fast motion (1 mm) from which on a hand is taken to feel.
FEELS = 0.0125
# Opening per step of the command by which a hand lets go: more than a hand that feels ever loosens its grip.
LETS_GO = 0.018


def memory_begins(commands: np.ndarray, first: np.ndarray) -> np.ndarray:
    """The row from which on each row (M,) of commands is remembered, given those at which demonstrations begin: that of the last fast
    motion.

    Two steps of a fast motion tell where a demonstration ends it. A policy that remembered them would go on to where it had aimed
    at first instead of looking.
    """
    change = np.diff(commands, axis=0, prepend=commands[:1])
    begins = np.linalg.norm(change[:, :3], axis=1) > FAST
    begins |= (change[:, GRIPPER] > FAST_GRIP) | (change[:, GRIPPER] < -LETS_GO)
    begins[first] = True
    return np.maximum.accumulate(np.where(begins, np.arange(len(commands)), 0))


def is_seen(commands: np.ndarray, rows: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """False on the rows of commands on which the hand feels: it has closed slowly since the last fast motion."""
    return commands[rows, GRIPPER] - commands[begins, GRIPPER] < FEELS


def holds(commands: np.ndarray, first: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """True on the rows (M,) on which the hand has felt an object and has not let go of it since, given the rows at which demonstrations
    begin."""
    index = np.arange(len(commands))
    lets_go = np.diff(commands[:, GRIPPER], prepend=commands[0, GRIPPER]) < -LETS_GO
    lets_go[first] = True
    felt, let_go = (np.maximum.accumulate(np.where(rows, index, -1)) for rows in (~is_seen(commands, index, begins), lets_go))
    return felt >= let_go
