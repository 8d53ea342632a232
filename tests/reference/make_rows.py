"""Makes the committed rows: `python make_rows.py [GROUP …]` writes rows/GROUP.jsonl and prints the seconds it took."""

import json
import os
import sys
import time

from softref import elements, small_strain, truth
from softref.squeeze import Squeeze

HERE = os.path.dirname(os.path.abspath(__file__))
CUBE = dict(shape="cube", size_m=0.05)
SPHERE = dict(shape="sphere", radius_m=0.025)
CAPSULE = dict(shape="capsule", radius_m=0.020, length_m=0.070, youngs_pa=1.5e4)
CYLINDER = dict(shape="cylinder", radius_m=0.020, length_m=0.060)
LIGHT = [49.9, 49.8, 49.7, 49.6, 49.5, 49.4, 49.3, 49.2, 49.1, 49.0]
DEEP = [48, 46, 44, 42, 38, 34, 30]
HALF_VOXEL = 0.05 / 12


def squeeze(gaps, **options):
    """Rows of one closing run; a gap that cannot be reached ends it."""
    run = Squeeze(**options)
    for gap in gaps:
        yield run.row(1e-3 * gap)


def strain_rows():
    """Small-strain stiffness over resolution, pad width and pad offset."""
    for n in (6, 12, 18, 24):
        for near_rigid in (False, True):
            yield small_strain.row(n, near_rigid=near_rigid)
    for n in (6, 12):
        for pad in [18, 20, 24] + [22 + 0.1 * i for i in range(1, 11)]:
            yield small_strain.row(n, pad=1e-3 * pad)
        for y, z in ((HALF_VOXEL, 0.0), (0.0, HALF_VOXEL), (HALF_VOXEL, HALF_VOXEL)):
            yield small_strain.row(n, offset=(y, z))
    for tenth in range(1, 11):
        yield small_strain.row(6, offset=(1e-4 * tenth, 0.0))


def pad_rows():
    """Gap 48 mm with other pads, at half-voxel offsets, and the edge moved in 0.1 mm steps."""
    for pad in [18, 20, 22] + [22 + 0.1 * i for i in range(1, 11)] + [24]:
        yield from squeeze([48], **CUBE, pad_m=1e-3 * pad)
    for offset in ((HALF_VOXEL, 0.0), (0.0, HALF_VOXEL)):
        yield from squeeze([48], **CUBE, pad_offset_m=offset)


def round_rows():
    """Sphere, lying capsule and lying cylinder at resolution 6, and their refined solution."""
    for n in (6, 12):
        yield from squeeze([49, 48, 46, 42, 38, 34], **SPHERE, resolution=n)
        yield from squeeze([39, 38, 36, 32, 28, 24], **CAPSULE, resolution=n)
        yield from squeeze([39, 38, 36, 32, 28], **CYLINDER, resolution=n)


def refined_round_rows():
    """The round shapes at resolution 18."""
    yield from squeeze([46, 42, 38], **SPHERE, resolution=18, step_m=5e-4)
    yield from squeeze([36, 32, 28], **CAPSULE, resolution=18, step_m=5e-4)
    yield from squeeze([36, 32, 28], **CYLINDER, resolution=18, step_m=5e-4)


def variant_rows():
    """Other sizes, materials, pads, resolutions and friction."""
    yield from squeeze([39, 38, 34], shape="cube", size_m=0.04, youngs_pa=1e4, poisson=0.45, density=500.0, pad_m=0.018, resolution=5)
    yield from squeeze([49.5, 48, 44], **CUBE, friction=0.6)
    yield from squeeze([48, 44], **CUBE, youngs_pa=1e5, poisson=0.3, resolution=8)
    yield from squeeze([48, 42], **CUBE, pad_m=0.040)
    yield from squeeze([57, 54, 48], shape="sphere", radius_m=0.03, youngs_pa=1e4, pad_m=0.020, resolution=8)
    yield from squeeze([29, 27, 24], shape="capsule", radius_m=0.015, length_m=0.09, youngs_pa=3e4, poisson=0.3, resolution=9)


def step_rows():
    """The cube with the load step halved twice: how far the rows depend on it."""
    for step in (1e-4, 5e-5, 2.5e-5):
        for row in squeeze([49.5, 48, 42], **CUBE, step_m=step):
            yield row | dict(step_mm=1e3 * step)


GROUPS = {
    "elements": elements.rows,
    "truth": truth.rows,
    "small_strain": strain_rows,
    "cube": lambda: squeeze(LIGHT + DEEP, **CUBE),
    "cube_12": lambda: squeeze([49, 48, 46, 42, 38], **CUBE, resolution=12),
    "cube_18": lambda: squeeze([48, 42], **CUBE, resolution=18, step_m=5e-4),
    "cube_24": lambda: squeeze([48, 42], **CUBE, resolution=24, step_m=5e-4),
    "pads": pad_rows,
    "round": round_rows,
    "round_18": refined_round_rows,
    "variants": variant_rows,
    "steps": step_rows,
}


def rounded(value):
    """Seven significant digits: more than the solution is good for."""
    if isinstance(value, float):
        return float(f"{value:.7g}")
    return [rounded(v) for v in value] if isinstance(value, list) else value


if __name__ == "__main__":
    for group in sys.argv[1:] or GROUPS:
        start = time.process_time()
        path = os.path.join(HERE, "rows", group + ".jsonl")
        with open(path, "w") as out:
            for row in GROUPS[group]():
                out.write(json.dumps({k: rounded(v) for k, v in row.items()}) + "\n")
                out.flush()
        print(f"{group}: {time.process_time() - start:.0f} s", flush=True)
