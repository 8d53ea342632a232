"""softvt's demonstrations in openpi: what a sample is to pi0.5, and the two configurations of docs/train-openpi.md.

Copy it to src/openpi/training/misc/softvt_config.py and add to src/openpi/training/config.py, where polaris_config stands:

    import openpi.training.misc.softvt_config as softvt_config      # among the imports
    *softvt_config.get_softvt_configs(),                            # at the end of _CONFIGS
"""

import dataclasses

import numpy as np
import openpi.models.model as _model
import openpi.models.pi0_config as pi0_config
import openpi.training.weight_loaders as weight_loaders
import openpi.transforms as _transforms

# Keys of the exported data set; softvt sends the same ones to a server.
VISION_KEYS = ("image", "wrist_image", "state", "actions", "prompt")
TACTILE_KEYS = (*VISION_KEYS, "tactile_image")


def _picture(value) -> np.ndarray:
    """uint8 (height, width, 3), whether from LeRobot (float 0..1, channels first) or from softvt."""
    value = np.asarray(value)
    if np.issubdtype(value.dtype, np.floating):
        # LeRobot has divided by 255: rounding gives the very bytes back, cutting off would not.
        value = np.clip(np.rint(255 * value), 0, 255).astype(np.uint8)
    return np.transpose(value, (1, 2, 0)) if value.shape[0] == 3 else value


@dataclasses.dataclass(frozen=True)
class SoftVTInputs(_transforms.DataTransformFn):
    """A sample as pi0.5 takes it, in training and when served. The touch of both fingers takes the place of a second wrist."""

    model_type: _model.ModelType
    tactile: bool

    def __call__(self, data: dict) -> dict:
        base = _picture(data["image"])
        touch = _picture(data["tactile_image"]) if self.tactile else np.zeros_like(base)
        # pi0-FAST masks nothing.
        seen = np.bool_(self.tactile or self.model_type == _model.ModelType.PI0_FAST)
        sample = {
            "state": np.asarray(data["state"], dtype=np.float32),
            "image": {
                "base_0_rgb": base,
                "left_wrist_0_rgb": _picture(data["wrist_image"]),
                "right_wrist_0_rgb": touch,
            },
            "image_mask": {"base_0_rgb": np.True_, "left_wrist_0_rgb": np.True_, "right_wrist_0_rgb": seen},
        }
        if "actions" in data:
            sample["actions"] = np.asarray(data["actions"], dtype=np.float32)
        if "prompt" in data:
            sample["prompt"] = data["prompt"]
        return sample


@dataclasses.dataclass(frozen=True)
class SoftVTOutputs(_transforms.DataTransformFn):
    """An answer as softvt reads it: pose, or joint positions, and gripper, without the padding."""

    joints: bool

    def __call__(self, data: dict) -> dict:
        return {"actions": np.asarray(data["actions"][..., : 8 if self.joints else 7])}


def get_softvt_configs():
    # Here, since config.py imports this file.
    from openpi.training.config import DataConfig, SimpleDataConfig, TrainConfig

    model = pi0_config.Pi0Config(
        pi05=True,
        action_horizon=50,
        paligemma_variant="gemma_2b_lora",
        action_expert_variant="gemma_300m_lora",
    )

    # joints: of an export with --control joints.
    def config(name: str, repo_id: str, *, tactile: bool, gripper: str, joints: bool = False):
        keys = TACTILE_KEYS if tactile else VISION_KEYS
        return TrainConfig(
            name=name,
            model=model,
            data=SimpleDataConfig(
                repo_id=repo_id,
                data_transforms=lambda model: _transforms.Group(
                    inputs=[SoftVTInputs(model_type=model.model_type, tactile=tactile)],
                    outputs=[SoftVTOutputs(joints=joints)],
                ),
                base_config=DataConfig(
                    prompt_from_task=True,
                    repack_transforms=_transforms.Group(inputs=[_transforms.RepackTransform({key: key for key in keys})]),
                ),
            ),
            weight_loader=weight_loaders.CheckpointWeightLoader("gs://openpi-assets/checkpoints/pi05_base/params"),
            freeze_filter=model.get_freeze_filter(),
            # The grip code of the export, and what the poses are. The server states them, and softvt refuses a profile with others.
            policy_metadata={"gripper": gripper, "pose": "joints" if joints else "absolute"},
            # Averaged weights are not for LoRA.
            ema_decay=None,
            batch_size=256,
            num_train_steps=7_000,
            num_workers=16,
        )

    return [
        config("pi05_softvt_vision", "softvt/object_soft_binary", tactile=False, gripper="binary"),
        config("pi05_softvt_tactile", "softvt/object_soft", tactile=True, gripper="continuous"),
    ]
