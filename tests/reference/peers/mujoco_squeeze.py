"""CPU time of the squeeze of benches/squeeze.rs with a flex of MuJoCo (pip install mujoco numpy).

A soft cube (edge 50 mm, 343 nodes, 30 kPa, Poisson's ratio 0.4, 300 kg/m³) on a table is gripped by two flat pads, lifted by 100 mm and
held. Prints CPU seconds per simulated second and the force of a pad as one JSON object per gap.
"""

import json
import time

import mujoco
import numpy as np

EDGE, PAD_HALF, CLEARANCE = 0.05, (5e-3, 11e-3, 11e-3), 2e-3
SETTLE, GRIP, LIFT, HOLD, RISE, CLOSING = 0.1, 0.25, 1.0, 0.5, 0.1, 0.04
STEP = 0.004
NODES = 7


def pad(name: str) -> str:
    """A pad that moves along x and z. It is so heavy that contact does not change its prescribed velocity: friction of mocap bodies
    would not see theirs."""
    size = " ".join(map(str, PAD_HALF))
    return f"""<body name="{name}" gravcomp="1"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
      <geom name="{name}" type="box" size="{size}" mass="1e4"/></body>"""


SCENE = f"""
<mujoco>
  <option timestep="{STEP}" solver="CG" iterations="100" tolerance="1e-6" integrator="discrete" cone="elliptic" impratio="100"/>
  <size memory="200M"/>
  <default><geom solref="{STEP} 1" friction="1.2" condim="3"/></default>
  <worldbody>
    <geom name="table" type="plane" size="0.5 0.5 0.05"/>
    {pad("left")}
    {pad("right")}
    <flexcomp name="cube" type="grid" dim="3" count="{NODES} {NODES} {NODES}" mass="{300 * EDGE**3}" radius="0.0005"
              spacing="{EDGE / (NODES - 1)} {EDGE / (NODES - 1)} {EDGE / (NODES - 1)}" pos="0 0 {EDGE / 2 + 0.0005}">
      <contact solref="{STEP} 1" friction="1.2" condim="3" selfcollide="none"/>
      <elasticity young="3e4" poisson="0.4" damping="0.002"/>
    </flexcomp>
  </worldbody>
</mujoco>
"""


def squeeze(model: mujoco.MjModel, gap: float) -> dict:
    """Runs one squeeze."""
    data = mujoco.MjData(model)
    closed = SETTLE + (0.5 * EDGE + CLEARANCE - 0.5 * gap) / CLOSING
    lifted = closed + GRIP
    end = lifted + LIFT + HOLD

    def place(at: float) -> np.ndarray:
        x = max(0.5 * EDGE + CLEARANCE - CLOSING * max(at - SETTLE, 0.0), 0.5 * gap) + PAD_HALF[0]
        s = min(max((at - lifted) / LIFT, 0.0), 1.0)
        z = RISE * s**3 * (10 + s * (6 * s - 15)) + 0.5 * EDGE
        return np.array([-x, z, x, z])

    begin = time.process_time()
    while data.time < end:
        now = place(data.time)
        data.qpos[:4], data.qvel[:4] = now, (place(data.time + STEP) - now) / STEP
        mujoco.mj_step(model, data)
    cpu = time.process_time() - begin
    force, wrench = 0.0, np.zeros(6)
    left = model.geom("left").id
    for index in range(data.ncon):
        if left in data.contact[index].geom:
            mujoco.mj_contactForce(model, data, index, wrench)
            force += wrench[0]
    rise = float(np.mean(data.flexvert_xpos[:, 2])) - 0.5 * EDGE
    return {
        "mujoco": mujoco.__version__,
        "gap_mm": 1e3 * gap,
        "cpu_per_sim_s": round(cpu / end, 3),
        "force_n": round(force, 3),
        "rise_mm": round(1e3 * rise, 1),
    }


if __name__ == "__main__":
    scene = mujoco.MjModel.from_xml_string(SCENE)
    for width in (0.048, 0.042):
        print(json.dumps(squeeze(scene, width)), flush=True)
