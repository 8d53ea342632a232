"""Motions by feedback laws: each command follows from the one before and from where the tool is, and none of them waits for a time. A policy
without memory can therefore learn them, which it cannot learn of a teacher that stops on its way: what it sees there does not tell how long the
hand has waited.

A command is (7,): position of the tool (m), rotation vector, closure.
"""

from dataclasses import dataclass

import numpy as np

from .numbers import GRIPPER, ROTATION, between, rotated

# Control step, s.
STEP = 0.05
# Share of the way to its command by which the arm moves in a step.
FOLLOWS = 0.39
# Reaching: largest speed, m/s, and the acceleration by which it falls towards the end, m/s²; least speed, m/s; turn per step, rad, and the
# horizontal distance within which the hand turns, m: from farther away, a picture does not show well how an object is turned.
REACH_SPEED, REACH_SLOWING, REACH_LEAST, TURN, TURNS_WITHIN = 0.4, 0.2, 0.02, 0.06, 0.04
# The hand comes down in a funnel: height over distance from its axis beyond a radius, m, and the distance that a turn counts, m/rad.
FUNNEL, RADIUS, PER_TURN = 8, 0.002, 0.1
# Distance, m, and turn, rad, at which the command has arrived, and distance at which the arm has, m. A hand that closed as soon as its command
# has arrived would learn to close while it cannot yet see whether it is where it should be.
ARRIVED, TURNED, FOLLOWED = 0.0005, 0.02, 0.001
# Change of the closure per step, about, and while the hand closes slowly: 0.1 mm of width, as tactile-servo does.
FAST_CLOSING, SLOW_CLOSING = 0.03, 0.00125
# Slow steps that are shown: more than those after which a hand is taken to feel.
SLOW_STEPS = 14
# Carrying: speeds up, along and down, m/s, least speed, and acceleration, m/s². A grip that was felt has little to spare for more.
UP, ALONG, DOWN, CARRY_LEAST, CARRY_ACCELERATION = 0.12, 0.2, 0.1, 0.03, 0.3
# Height below that of the way over obstacles at which the hand begins to move along it, m, and slope and radius of the funnel down.
BELOW, CARRY_FUNNEL, CARRY_RADIUS = 0.03, 6, 0.004
# Opening at the release, per step, and height to which the empty hand rises, m.
OPENING, RISE = 0.04, 0.08
# Largest number of steps of a motion.
MOST_STEPS = 200


@dataclass
class Grasp:
    """Where a hand grasps."""

    pose: np.ndarray  # (6,) position and rotation vector
    over: float  # height at which the hand passes above obstacles, m
    opening: float  # closure on the way
    closure: float  # from which on the hand closes slowly


@dataclass
class Release:
    """Where a hand lets go of an object."""

    pose: np.ndarray  # (6,)
    over: float
    closure: float  # after the release


def _towards(value: float, end: float, most: float) -> float:
    return value + min(max(end - value, -most), most)


def _slowed(distance: float, most: float, slowing: float, least: float) -> float:
    """The way of a step, m, at a distance from the end."""
    return STEP * min(most, least + (2 * slowing * distance) ** 0.5)


def reach_step(command: np.ndarray, tool: np.ndarray, grasp: Grasp) -> np.ndarray:
    """The next command of a hand whose tool is at a position (3,), and which reaches an object and closes around it."""
    found, away = command.copy(), grasp.pose[:2] - command[:2]
    distance, turn = float(np.hypot(*away)), between(command[ROTATION], grasp.pose[3:])
    angle = float(np.linalg.norm(turn))
    off = max(distance - RADIUS, 0) + PER_TURN * max(angle - TURNED, 0)
    height = min(grasp.over - grasp.pose[2], FUNNEL * off)
    if distance > 0:
        found[:2] += away * min(1, _slowed(distance, REACH_SPEED, REACH_SLOWING, REACH_LEAST) / distance)
    down = grasp.pose[2] + height
    found[2] = _towards(command[2], down, _slowed(abs(command[2] - down), REACH_SPEED, REACH_SLOWING, REACH_LEAST))
    if distance < TURNS_WITHIN and angle > 0:
        found[ROTATION] = rotated(command[ROTATION], turn * min(1, TURN / angle))
    has_arrived = distance < ARRIVED and abs(command[2] - grasp.pose[2]) < ARRIVED and angle < TURNED
    has_arrived = has_arrived and float(np.linalg.norm(tool - grasp.pose[:3])) < FOLLOWED
    closure = command[GRIPPER]
    if not has_arrived:
        found[GRIPPER] = _towards(closure, grasp.opening, FAST_CLOSING)
    elif closure < grasp.closure - 1e-6:
        # In equal steps: a short last one would pass for slow closing.
        found[GRIPPER] = closure + (grasp.closure - closure) / max(1, round((grasp.closure - closure) / FAST_CLOSING))
    else:
        found[GRIPPER] = closure + SLOW_CLOSING
    return found


def reach(command: np.ndarray, grasp: Grasp) -> np.ndarray:
    """Commands (n, 7) from one at which the hand rests to the first slow steps of closing."""
    commands, tool = [command], command[:3]
    while len(commands) <= MOST_STEPS and commands[-1][GRIPPER] < grasp.closure + SLOW_STEPS * SLOW_CLOSING - 1e-6:
        commands.append(reach_step(commands[-1], tool, grasp))
        tool = tool + FOLLOWS * (commands[-1][:3] - tool)
    return np.array(commands[1:])


def carry_step(command: np.ndarray, held: np.ndarray, release: Release) -> np.ndarray:
    """The next command of a hand that was closed around an object at the command `held`, and takes it to where it lets go."""
    found, away = command.copy(), release.pose[:2] - command[:2]
    distance, height = float(np.hypot(*away)), command[2]
    if command[GRIPPER] < held[GRIPPER] - OPENING / 2:  # is open
        found[GRIPPER] = max(release.closure, command[GRIPPER] - OPENING)
        found[2] = _towards(height, release.pose[2] + RISE, STEP * UP)
        return found
    most = max(release.over, held[2] + BELOW) if distance > CARRY_RADIUS else release.over
    down = min(most, release.pose[2] + CARRY_FUNNEL * max(distance - CARRY_RADIUS, 0))
    if height < down:
        fast = min(
            _slowed(max(height - held[2], 0), UP, CARRY_ACCELERATION, CARRY_LEAST),
            _slowed(down - height, UP, CARRY_ACCELERATION, CARRY_LEAST),
        )
    else:
        fast = _slowed(height - down, DOWN, CARRY_ACCELERATION, CARRY_LEAST)
    found[2] = _towards(height, down, fast)
    # Along the way as soon as the hand is high enough, and faster the farther it is from both ends.
    share = min(max(1 - (down - height) / BELOW, 0), 1)
    gone = float(np.hypot(*(command[:2] - held[:2])))
    along = min(_slowed(gone, ALONG, CARRY_ACCELERATION, CARRY_LEAST), _slowed(distance, ALONG, CARRY_ACCELERATION, CARRY_LEAST)) * share
    if distance > 0:
        found[:2] += away * min(1, along / distance)
        turn = between(command[ROTATION], release.pose[3:])
        found[ROTATION] = rotated(command[ROTATION], turn * min(1, along / distance))
    if distance < CARRY_RADIUS and height - release.pose[2] < ARRIVED:
        found[GRIPPER] = command[GRIPPER] - OPENING
    return found


def carry(command: np.ndarray, release: Release, after: int = 20) -> np.ndarray:
    """Commands (n, 7) from a grip to `after` steps after the release began."""
    commands, opened = [command], 0
    while len(commands) <= 2 * MOST_STEPS and opened < after:
        commands.append(carry_step(commands[-1], command, release))
        opened += commands[-1][GRIPPER] < command[GRIPPER]
    return np.array(commands[1:])


def travel(command: np.ndarray, end: np.ndarray, over: float) -> np.ndarray:
    """Commands (n, 7) to another one, above a height on the way."""
    commands = [command]
    while len(commands) <= MOST_STEPS:
        now = commands[-1]
        away, found = end[:2] - now[:2], now.copy()
        distance, turn = float(np.hypot(*away)), between(now[ROTATION], end[ROTATION])
        angle = float(np.linalg.norm(turn))
        if distance + abs(end[2] - now[2]) < 1e-6 and angle < 1e-6 and abs(end[GRIPPER] - now[GRIPPER]) < 1e-9:
            break
        found[GRIPPER] = _towards(now[GRIPPER], end[GRIPPER], FAST_CLOSING)
        is_free = now[GRIPPER] <= end[GRIPPER] + 1e-9  # an object may be between the fingers
        high = max(over, end[2]) if distance > 1e-6 else end[2]
        if is_free:
            found[2] = _towards(now[2], high, STEP * REACH_SPEED)
        if now[2] >= high - 1e-6 and distance > 0:
            found[:2] += away * min(1, STEP * REACH_SPEED / distance)
        if is_free and now[2] >= high - 1e-6 and angle > 0:
            found[ROTATION] = rotated(now[ROTATION], turn * min(1, 0.15 / angle))
        commands.append(found)
    return np.array(commands[1:]).reshape(-1, 7)
