"""Recomputes a few committed rows (<= 60 s) and compares them: `python check.py`; exit status 1 if one differs."""

import json
import os
import sys

import numpy as np
from make_rows import CAPSULE, CUBE, HERE, squeeze
from softref import elements, small_strain
from softref.squeeze import Squeeze
from softref.statics import TOLERANCE

LIMIT = 1e-5


def committed(group, **keys):
    """The committed rows of a group that agree in `keys`."""
    with open(os.path.join(HERE, "rows", group + ".jsonl")) as lines:
        rows = [json.loads(line) for line in lines]
    return [r for r in rows if all(r.get(k) == v for k, v in keys.items())]


def differ(old, new, fields):
    """Largest relative difference over the fields."""
    return max(abs(old[f] - new[f]) / max(abs(old[f]), 1e-12) for f in fields)


def checks():
    """Yields (what, measured, limit)."""
    for r in elements.clamped("without", gaps=(48, 46)) + elements.clamped("gauss", gaps=(48, 46)):
        yield f"published clamped {r['law']} {r['gap_mm']} mm", abs(r["force_n"] / r["published_n"] - 1), 6e-4
    yield "patch test", elements.patch()[0]["max_rel_disp_error"], 1e-9
    for r in elements.fillings():
        yield f"homogeneous strain of partly filled voxels, nu {r['nu']}", r["max_rel_force_error"], 1e-12
        yield f"zero modes beside the six, nu {r['nu']}", max(abs(m - 6) for m in r["zero_modes"]), 0
    for r in elements.bending():
        yield f"pure bending, nu {r['nu']}", abs(r["moment_over_ei"] - 1), 1e-9
    one = elements.spurious()[0]
    yield "force is -dU/dx", one["force_error_exact"], 1e-7
    yield "no moment", one["moment_exact"], 1e-12
    for old in committed("small_strain", resolution=6, pad_offset_mm=[0.0, 0.0], pad_mm=22.0, contact="softvt"):
        yield "small strain", differ(old, small_strain.row(6), ["stiffness_n_per_m", "d_pct_per_mm_7cubed"]), LIMIT
    fields = ["force_grip_n", "force_hold_n", "d_grip_pct", "d_hold_pct", "d_hold_volume_pct", "min_det_f_grip"]
    for group, options, gap in (("cube", CUBE, 49.0), ("cube", CUBE, 48), ("round", CAPSULE | dict(resolution=6), 38)):
        old = committed(group, shape=options["shape"], gap_mm=gap, resolution=6)[0]
        run = Squeeze(**options)
        new, grip = run.row(1e-3 * gap), run.state()
        yield f"{options['shape']} {gap} mm", differ(old, new, fields), LIMIT
        carried = 2 * grip["friction_z_n"] + grip["table_n"]
        yield f"{options['shape']} {gap} mm balance of vertical forces, N", abs(carried - run.scene.weight_n), 100 * TOLERANCE
    whole = next(squeeze([49.0], **CUBE, pad_offset_m=(1e-12, 0.0)))
    yield "without the mirror in y", differ(committed("cube", gap_mm=49.0)[0], whole, fields), LIMIT


if __name__ == "__main__":
    bad = 0
    for what, measured, limit in checks():
        good = np.isfinite(measured) and measured <= limit
        bad += not good
        print(f"{'ok ' if good else 'BAD'} {what}: {measured:.2e} (limit {limit:.0e})", flush=True)
    sys.exit(bad > 0)
