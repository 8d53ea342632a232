"""Puts exported rows and what softvt sends through examples/openpi/softvt_config.py, with as little of openpi as it touches:
stand-ins for the classes that it makes. Says nothing of openpi itself."""

import dataclasses
import enum
import importlib.util
import io
import pathlib
import sys
import types

import numpy as np
import pyarrow.parquet as pq
from PIL import Image


class ModelType(enum.Enum):
    PI05 = 1
    PI0_FAST = 2


class Recorded:
    """Remembers what it was made with."""

    def __init__(self, *args, **fields):
        self.args, self.fields = args, fields

    def get_freeze_filter(self):
        return "frozen"


def stand_in(name, **contents):
    module = sys.modules[name] = types.ModuleType(name)
    for key, value in contents.items():
        setattr(module, key, value)
    if "." in name:
        above, last = name.rsplit(".", 1)
        setattr(sys.modules[above], last, module)


def load():
    for name in ("openpi", "openpi.models", "openpi.training"):
        stand_in(name)
    stand_in("openpi.models.model", ModelType=ModelType)
    stand_in("openpi.models.pi0_config", Pi0Config=Recorded)
    stand_in("openpi.training.weight_loaders", CheckpointWeightLoader=Recorded)
    stand_in("openpi.transforms", DataTransformFn=object, Group=Recorded, RepackTransform=Recorded)
    stand_in("openpi.training.config", DataConfig=Recorded, SimpleDataConfig=Recorded, TrainConfig=Recorded)
    path = pathlib.Path(__file__).parents[2] / "examples/openpi/softvt_config.py"
    spec = importlib.util.spec_from_file_location("softvt_config", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["softvt_config"] = module
    spec.loader.exec_module(module)
    return module


def is_continuous(table):
    """The rotation vectors of states and actions do not jump, and are on the same side."""
    state, actions = (np.array(table[key].to_pylist())[:, 3:6] for key in ("state", "actions"))
    assert max(np.linalg.norm(np.diff(vectors, axis=0), axis=1).max() for vectors in (state, actions)) < 1
    assert np.linalg.norm(actions - state, axis=1).max() < 1


def main(root):
    softvt = load()
    row = pq.read_table(sorted(pathlib.Path(root).glob("data/*/*.parquet"))[0]).slice(5, 1).to_pylist()[0]
    pictures = {key: np.asarray(Image.open(io.BytesIO(row[key]["bytes"]))) for key in ("image", "wrist_image", "tactile_image")}
    sent = pictures | {"state": np.array(row["state"], np.float32), "prompt": "do it"}
    # LeRobot gives pictures as its loader makes them, and a chunk of actions.
    floats = {key: (picture.transpose(2, 0, 1) / np.float32(255)).astype(np.float32) for key, picture in pictures.items()}
    trained = floats | {"state": sent["state"], "prompt": "do it", "actions": np.tile(np.float32(row["actions"]), (50, 1))}
    for tactile in (False, True):
        inputs = softvt.SoftVTInputs(model_type=ModelType.PI05, tactile=tactile)
        one, other = inputs(dict(trained)), inputs(sent | {"observation/image": pictures["image"]})
        assert one.pop("actions").shape == (50, 7)
        assert set(one) == set(other) == {"state", "image", "image_mask", "prompt"}
        assert (one["state"] == other["state"]).all() and one["state"].dtype == np.float32
        for slot, key in zip(("base_0_rgb", "left_wrist_0_rgb", "right_wrist_0_rgb"), pictures):
            seen = bool(one["image_mask"][slot])
            assert seen == bool(other["image_mask"][slot]) == (tactile or key != "tactile_image")
            expected = pictures[key] if seen else np.zeros((224, 224, 3), np.uint8)
            for sample in (one, other):
                assert sample["image"][slot].dtype == np.uint8 and (sample["image"][slot] == expected).all(), (slot, tactile)
    is_continuous(pq.read_table(sorted(pathlib.Path(root).glob("data/*/*.parquet"))[0], columns=["state", "actions"]))
    answer = softvt.SoftVTOutputs(joints=False)({"actions": np.ones((50, 32))})
    assert answer["actions"].shape == (50, 7)
    joints = softvt.SoftVTOutputs(joints=True)({"actions": np.ones((50, 32))})
    assert joints["actions"].shape == (50, 8)
    vision, touch = softvt.get_softvt_configs()
    assert (vision.fields["num_train_steps"], vision.fields["batch_size"]) == (7000, 256)
    for config, keys in ((vision, softvt.VISION_KEYS), (touch, softvt.TACTILE_KEYS)):
        repack = config.fields["data"].fields["base_config"].fields["repack_transforms"].fields["inputs"][0]
        assert repack.args == ({key: key for key in keys},)
        assert set(keys) - {"prompt"} <= set(row), "keys of the data set"
        group = config.fields["data"].fields["data_transforms"](types.SimpleNamespace(model_type=ModelType.PI05))
        assert group.fields["inputs"][0].tactile == (config is touch)
    assert dataclasses.is_dataclass(softvt.SoftVTInputs)
    print("softvt_config.py: training and serving see the same")


if __name__ == "__main__":
    main(*sys.argv[1:])
