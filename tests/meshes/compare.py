"""Compares mesh files of PyPI packages as `softvt.mesh` reads them with what trimesh reads: compare.py SOFTVT FOLDER."""

import json
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import trimesh

BULLET = "genesis/assets/urdf/"
FRANKA = "genesis/assets/xml/"
HAND = "myosuite/envs/myo/assets/MPL_sim/meshes/mplL/"
# Some have seams of texture coordinates and polygons (OBJ), cracks (wristy_left) and y up (GLB).
SOLIDS = [
    "genesis/assets/meshes/bolt_nut/bolt.stl",
    "genesis/assets/meshes/bolt_nut/nut.stl",
    "genesis/assets/meshes/chopping-board/source/chopping_board.glb",
    "genesis/assets/meshes/cross_cutter.obj",
    "genesis/assets/meshes/sphere.obj",
    "genesis/assets/meshes/wooden_sphere_OBJ/wooden_sphere.obj",
    "genesis/assets/meshes/worm/worm.obj",
    "genesis/assets/tower/ball.glb",
    BULLET + "3763/textured_objs/original-2_vhacd.obj",
    BULLET + "blue_box/assets/part_1.stl",
    BULLET + "kuka_iiwa/meshes/finger_tip_left.stl",
    BULLET + "panda_bullet/meshes/collision/link1.obj",
    BULLET + "shadow_hand/meshes/collision/palm.stl",
    BULLET + "wheel/wheel.obj",
    FRANKA + "franka_emika_panda/assets/finger_0.obj",
    FRANKA + "franka_emika_panda/assets/link5_collision_0.obj",
    FRANKA + "franka_sim/meshes/visual/link1.stl",
    FRANKA + "tet.obj",
    FRANKA + "thin_cube.obj",
    HAND + "humerus_lower_top_link-cvx.stl",
    HAND + "index0_left.stl",
    HAND + "palm_left.stl",
    HAND + "wristy_left.stl",
    "myosuite/envs/myo/assets/pingpong.obj",
]
# Files of surfaces that are not closed.
OPEN = ["genesis/assets/meshes/cloth.obj", "genesis/assets/tower/ring_01.glb", BULLET + "kuka_iiwa/meshes/link_1.stl"]


def of_trimesh(path: Path) -> np.ndarray:
    """Volume of a file, and its bounds with z up."""
    mesh = trimesh.load(path, force="mesh")
    low, high = mesh.bounds
    if path.suffix == ".glb":
        low, high = [low[0], -high[2], low[1]], [high[0], -low[2], high[1]]
    return np.array([abs(mesh.volume), *low, *high])


softvt, folder = sys.argv[1], Path(sys.argv[2])
packages = Path(sysconfig.get_paths()["purelib"])
folder.mkdir()
shutil.copy(Path(__file__).with_name("meshes.lua"), folder)
names = {f"{index}{Path(path).suffix}": path for index, path in enumerate(SOLIDS + OPEN)}
for name, path in names.items():
    shutil.copy(packages / path, folder / name)
(folder / "files.lua").write_text("return {" + ", ".join(map(json.dumps, names)) + "}\n")
run = subprocess.run([softvt, "meshes.lua", "--json"], cwd=folder, check=True, capture_output=True, text=True)
rows = {row["file"]: row for row in map(json.loads, run.stdout.splitlines())}
wrong = []
for name, path in names.items():
    row = rows[name]
    if path in OPEN:
        if "the mesh is open" not in row.get("refused", ""):
            wrong.append(f"{path}: not refused as open: {row}")
        continue
    if "refused" in row:
        wrong.append(f"{path}: {row['refused']}")
        continue
    found, expected = np.array([row["volume"], *row["low"], *row["high"]]), of_trimesh(packages / path)
    edge = np.max(expected[4:] - expected[1:4])
    # Corners are numbers of 32 bits.
    if not np.allclose(found, expected, rtol=1e-5, atol=[1e-6 * edge**3, *[1e-6 * edge] * 6]):
        wrong.append(f"{path}: {found}, but trimesh finds {expected}")
if wrong:
    sys.exit("\n".join(wrong))
print(f"{len(SOLIDS)} mesh files of others are read as trimesh reads them, and {len(OPEN)} are refused as open")
