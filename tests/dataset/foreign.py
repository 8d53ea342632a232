"""Writes demonstrations that softvt recorded as LIBERO, robomimic and SoftVTBench write theirs, with h5py as they do."""

import json
import sys

import h5py
import numpy as np

# Where LIBERO's table scene has its robot; softvt's own is as far above its table, whose top is at 0.
BASE = np.array([-0.66, 0.0, 0.912])
OURS = np.array([-0.66, 0.0, 0.012])
# From the tool to robosuite's grip site, along the tool.
SITE = -0.0069
NAMES = {
    "bowl": "akita_black_bowl_1",
    "other_bowl": "akita_black_bowl_2",
    "ramekin": "glazed_rim_porcelain_ramekin_1",
    "cookies": "cookies_1",
    "plate": "plate_1",
}


def matrix(v):
    angle = np.linalg.norm(v)
    x, y, z = v / max(angle, 1e-12)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def vector(r):
    """Rotation vector of a matrix, of less than a half turn."""
    angle = np.arccos(np.clip((np.trace(r) - 1) / 2, -1, 1))
    axis = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    return axis * (0.5 if angle < 1e-9 else angle / (2 * np.sin(angle)))


def deltas(demo):
    """Shares of a step: from where the tool was before each action to where it was told to go."""
    pose, action, shut = demo["obs/state"][:], demo["actions"][:], demo["actions_binary"][:, 6]
    rows = []
    for at, told, closed in zip(pose, action, shut):
        turn = vector(matrix(told[3:6]) @ matrix(at[3:6]).T)
        rows.append(np.concatenate([(told[:3] - at[:3]) / 0.05, turn / 0.5, [1.0 if closed else -1.0]]))
    rows = np.array(rows)
    print(f"  longest share of a step: {np.abs(rows[:, :6]).max():.2f}")
    return np.clip(rows, -1, 1)


def after(rows):
    """What is observed after each action; what comes after the last is not known."""
    return np.concatenate([rows[1:], rows[-1:]])


def placed(demo):
    """Rigid things at the start: name, pose in LIBERO's world."""
    for name, item in demo["privileged/states/rigid_object"].items():
        if name in NAMES:
            pose = item["root_pose_w"][0].copy()
            pose[:3] += BASE - OURS
            yield NAMES[name], pose


def libero(source, target):
    things = []
    with h5py.File(source) as ours, h5py.File(target, "w") as file:
        data = file.create_group("data")
        for name in ours["data"]:
            demo, into = ours["data"][name], data.create_group(name)
            actions, joints = deltas(demo), demo["obs/arm_joint_pos"][:]
            state, fingers = demo["obs/state"][:], demo["obs/gripper_pos"][:] * [1, -1]
            things = list(placed(demo))
            poses = np.concatenate([pose for _, pose in things])
            site = np.array([at[:3] + BASE + matrix(at[3:6]) @ [0, 0, SITE] for at in state])
            turn = state[:, 3:6]
            steps = len(actions)
            quiet = np.zeros(9 + 6 * len(things))
            flat = [np.concatenate([[0.05 * i], joints[i], fingers[i], poses, quiet]) for i in range(steps)]
            obs = into.create_group("obs")
            obs.create_dataset("gripper_states", data=after(fingers))
            obs.create_dataset("joint_states", data=after(joints))
            obs.create_dataset("ee_states", data=after(np.hstack([site, turn])))
            obs.create_dataset("ee_pos", data=after(site))
            obs.create_dataset("ee_ori", data=after(turn))
            obs.create_dataset("agentview_rgb", data=np.zeros((steps, 8, 8, 3), np.uint8))
            into.create_dataset("actions", data=actions)
            into.create_dataset("states", data=np.array(flat))
            ends = np.zeros(steps, np.uint8)
            ends[-1] = 1
            into.create_dataset("rewards", data=ends)
            into.create_dataset("dones", data=ends)
            into.attrs["num_samples"] = steps
            links = "".join(f'<body name="robot0_link{i}"><joint name="robot0_joint{i}" axis="0 0 1"/>' for i in range(1, 8))
            hand = (
                '<body name="gripper0_leftfinger"><joint type="slide" name="l"/></body><body name="r"><joint type="slide" name="r"/></body>'
            )
            bodies = "".join(
                f'<body name="{thing}_main" pos="0 0 0"><joint type="free" name="{thing}_joint0"/></body>' for thing, _ in things
            )
            into.attrs["model_file"] = (
                f'<mujoco model="base"><worldbody><geom name="floor"/><body name="robot0_base" pos="-0.66 0 0.912">'
                f"{links}{hand}{'</body>' * 7}</body>{bodies}</worldbody></mujoco>"
            )
            language = demo.attrs["language"]
        kwargs = {
            "robots": ["Panda"],
            "control_freq": 20,
            "controller_configs": {"type": "OSC_POSE", "output_max": [0.05] * 3 + [0.5] * 3, "control_delta": True},
        }
        data.attrs["env_args"] = json.dumps(
            {"type": 1, "env_name": "Libero_Tabletop_Manipulation", "problem_name": "libero_tabletop_manipulation", "env_kwargs": kwargs}
        )
        data.attrs["env_name"] = "Libero_Tabletop_Manipulation"
        data.attrs["problem_info"] = json.dumps({"problem_name": "x", "language_instruction": language.upper()})
        data.attrs["bddl_file_name"] = "bddl_files/libero_spatial/" + language.replace(" ", "_") + ".bddl"
        data.attrs["num_demos"] = len(ours["data"])


def robomimic(source, target):
    """Observations before each action by robomimic's names, quaternions x y z w; nothing about objects."""
    with h5py.File(source) as ours, h5py.File(target, "w") as file:
        data = file.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_name": "Lift", "type": 1, "env_kwargs": {"robots": "Panda", "control_freq": 20}})
        for name in ours["data"]:
            demo, into = ours["data"][name], data.create_group(name)
            pose = demo["obs/eef_pose"][:]
            into.create_dataset("actions", data=deltas(demo))
            into.create_dataset("states", data=np.zeros((len(pose), 32)))
            into.create_dataset("obs/robot0_joint_pos", data=demo["obs/arm_joint_pos"][:])
            into.create_dataset("obs/robot0_eef_pos", data=pose[:, :3] + BASE)
            into.create_dataset("obs/robot0_eef_quat", data=pose[:, [4, 5, 6, 3]])
            into.attrs["num_samples"] = len(pose)


def softvtbench(source, target):
    with h5py.File(source) as ours, h5py.File(target, "w") as file:
        data = file.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_name": "Isaac-Libero-Franka-IK-Abs-v0", "type": 2})
        for name in ours["data"]:
            demo, into = ours["data"][name], data.create_group(name)
            state, pose, finger = demo["obs/state"][:], demo["obs/eef_pose"][:], demo["obs/gripper_pos"][:]
            force = demo["privileged/gripper_net_force"][:].reshape(len(state), 6)
            into.create_dataset("actions", data=np.hstack([state[:, :6], finger[:, :1], force]).astype(np.float32), compression="gzip")
            into.create_dataset("obs/eef_pose", data=pose.astype(np.float32))
            into.create_dataset("obs/gripper_pos", data=finger.astype(np.float32))
            into.create_dataset("obs/arm_joint_pos", data=demo["obs/arm_joint_pos"][:].astype(np.float32))
            into.create_dataset("obs/actions", data=np.hstack([pose, finger[:, :1]]).astype(np.float32))
            into.create_dataset("obs/gripper_net_force", data=np.repeat(force.reshape(-1, 1, 2, 3), 4, axis=1).astype(np.float32))
            start = into.create_group("initial_state")
            start["articulation/robot/root_pose"] = np.array([[*BASE, 1, 0, 0, 0]], np.float32)
            start["articulation/robot/joint_position"] = np.hstack([demo["obs/arm_joint_pos"][:1], finger[:1]]).astype(np.float32)
            states = demo["privileged/states"]
            for thing, item in states.get("rigid_object", {}).items():
                there = item["root_pose_w"][:1].copy()
                there[0, :3] += BASE - OURS
                start[f"rigid_object/{thing}_1/root_pose"] = there.astype(np.float32)
            for thing, item in states.get("deformable_object", {}).items():
                start[f"deformable_object/{thing}/nodal_position"] = (item["nodal_pos_w"][:1] + BASE - OURS).astype(np.float32)
            for attribute in ["language", "asset_name"]:
                into.attrs[attribute] = demo.attrs[attribute]
            into.attrs["task_suite"], into.attrs["task_id"] = "libero_spatial", int(demo.attrs["task_id"])
            into.attrs["num_samples"], into.attrs["success"] = len(state), True


if __name__ == "__main__":
    {"libero": libero, "robomimic": robomimic, "softvtbench": softvtbench}[sys.argv[1]](*sys.argv[2:])
