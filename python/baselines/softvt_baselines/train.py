"""Training: all demonstrations lie in the memory of the device, and batches are drawn there."""

import copy
import math
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from . import UserError, prompts
from .checkpoint import Checkpoint, save
from .data import LEAST_SPREAD, Demonstrations, Statistics, seen_reference
from .inputs import REMEMBERED, SHARES, TOUCH, Shape
from .model import Policy
from .numbers import FINE, FINE_READINGS, ROTATION, Standard, fine, hand, reference, turned, turns
from .phases import holds

# Training, after ACT: learning rate and its last share, weight decay, warm-up (steps), decay of the averaged weights.
RATE, LAST_RATE, WEIGHT_DECAY, WARM_UP, AVERAGE = 3e-4, 0.02, 1e-4, 300, 0.999
# Augmentation: random shift of a picture (share of its edge), brightness.
SHIFT, BRIGHTNESS = 0.045, 0.1
# Noise of the state: position (m), rotation vector (rad), finger (m), commanded closure. Actions stay where they are, so it teaches to return.
STATE_NOISE = [0.005] * 3 + [0.02] * 3 + [0.0001, 0]
# The same of a policy with memory: noise of the pose in fast motions as a share of the motion in the next AHEAD steps, at most STATE_NOISE;
# and relative noise of what it remembers. A hand that feels moves by less than any noise of the pose.
SHARE, AHEAD, MEMORY_NOISE = 0.3, 10, 0.02
# Samples of a hand that feels for each other sample: they have no pictures.
FEELING = 8
# Noise of the remembered positions along the axes of such a hand, m. A teacher's small motions tell what it has decided: tactile-servo rises
# by exactly 0.03 mm per step once it has found its grip. They are no reason to decide the same.
HIDDEN_MOTION = [1e-4, 1e-4, 3e-4]
REPORT = 200  # steps between two lines of the log
# Steps between which the rate of training is measured, once compiling is over and before the learning rate falls.
TIMED = (50, 150)


@dataclass
class TrainOptions:
    shape: Shape
    steps: int
    batch: int
    seed: int
    device: torch.device
    is_compiled: bool = False  # compile the network, which takes a minute and needs a C compiler
    seconds: float = math.inf  # time that training should take: there are fewer steps if they are too slow


class Batches:
    """Batches of observations and chunks of actions, drawn on the device."""

    def __init__(self, demos: Demonstrations, statistics: Statistics, options: TrainOptions):
        def on_device(array: np.ndarray) -> Tensor:
            return torch.tensor(array, device=options.device)

        self.shape, self.device = options.shape, options.device
        self.pictures, self.picture = {key: on_device(demos.pictures[key]) for key in options.shape.pictures}, on_device(demos.picture)
        self.state, self.actions = on_device(demos.state), on_device(demos.actions)
        self.state_mean, self.state_std = on_device(statistics.state.mean), on_device(statistics.state.std)
        self.action_mean, self.action_std = on_device(statistics.action.mean), on_device(statistics.action.std)
        self.felt_mean, self.felt_std = on_device(statistics.felt.mean), on_device(statistics.felt.std)
        self.noise = on_device(np.float32(STATE_NOISE[: self.shape.state]))
        self.row, self.start, self.last = on_device(demos.row), on_device(demos.start), on_device(demos.last)
        self.prompts = on_device(np.array([prompts.encode(prompt) for prompt in demos.prompts]))
        self.prompt = on_device(demos.prompt)
        if self.shape.has_markers:
            touch = demos.contact if self.shape.touch == "contact" else demos.markers / statistics.marker_scale
            self.touch = on_device(touch.astype(np.float16))
        if self.shape.has_tactile_pictures:
            self.tactile_pictures, self.tactile_picture = on_device(demos.tactile_pictures), on_device(demos.tactile_picture)
        self.steps = torch.arange(len(demos.actions), device=options.device)
        if self.shape.has_memory:
            felt = demos.contact if self.shape.touch == "contact" else demos.readings[:, : TOUCH[self.shape.touch]]
            self.hand, self.commands, self.readings = on_device(hand(demos.state)), on_device(demos.commands), on_device(felt)
            begin, seen = demos.begin, demos.seen
            self.begin, self.shares = on_device(begin), on_device(SHARES)
            self.axes = on_device(turns(demos.commands[:, ROTATION]))
            if seen.all():
                raise UserError(
                    "no demonstration closes the hand slowly: --memory needs those of a teacher that feels, such as tactile-servo"
                )
            self.seen, self.feeling_steps = on_device(seen.astype(np.float32)), on_device(np.flatnonzero(~seen))
            self.held = on_device(np.float32(holds(demos.commands, demos.start, begin))[:, None])
            self.steps = on_device(np.flatnonzero(seen))
            self.hidden = on_device(np.float32(HIDDEN_MOTION))
            # A finger touches or not: nothing lies between.
            self.fine, self.fine_readings = on_device(FINE), on_device(FINE_READINGS if self.shape.touch == "markers" else np.float32(0))
        self.steps = self.steps[(self.picture[self._frames(self.steps)] >= 0).all(1)]
        if self.shape.has_tactile_pictures:
            trained = [self.steps, self.feeling_steps] if self.shape.has_memory else [self.steps]
            if any((self.tactile_picture[self._tactile_rows(steps)] < 0).any() for steps in trained):
                raise UserError("the recording has no tactile pictures of some steps; make it again, with demonstrate --tactile-pictures")
        self.random = torch.Generator(options.device).manual_seed(options.seed)

    def _past(self, steps: Tensor, back: tuple[int, ...]) -> Tensor:
        """Recorded steps (B, len(back)) before some steps, at the earliest the first of their demonstrations."""
        earlier = self.row[steps][:, None] - torch.tensor(back, device=self.device)
        return torch.maximum(earlier, self.start[steps][:, None])

    def _frames(self, steps: Tensor) -> Tensor:
        """The recorded steps (B, frames) whose pictures and states are seen in some steps."""
        return self._past(steps, tuple(range(self.shape.frames - 1, -1, -1)))

    def _shifted(self, pictures: Tensor) -> Tensor:
        """Pictures (B, F, E, E, 3), each group of frames moved by a few pixels, with the border repeated."""
        batch, _, edge = pictures.shape[:3]
        most = round(SHIFT * edge)
        moves = torch.randint(-most, most + 1, (2, batch, 1), generator=self.random, device=self.device)
        rows, columns = ((torch.arange(edge, device=self.device) + move).clamp(0, edge - 1) for move in moves)
        groups = torch.arange(batch, device=self.device)[:, None, None]
        return pictures.transpose(1, 2).transpose(2, 3)[groups, rows[:, :, None], columns[:, None, :]].permute(0, 3, 1, 2, 4)

    def _blurred(self, numbers: Tensor, scale: Tensor) -> Tensor:
        """Numbers with noise that is even on the fine scale."""
        noise = torch.randn((2, *numbers.shape), generator=self.random, device=self.device)
        return numbers + MEMORY_NOISE * (noise[0] * numbers + noise[1] * scale)

    def _tactile_rows(self, steps: Tensor) -> Tensor:
        """The recorded steps (B, steps) whose tactile pictures are seen in some steps."""
        rows = self._past(steps, self.shape.touch_steps)
        return torch.maximum(rows, self.begin[self.row[steps]][:, None]) if self.shape.has_memory else rows

    def _tactile(self, steps: Tensor) -> Tensor:
        """The tactile pictures (B, steps, *CELLS) that are seen in some steps. They are not shifted, since the gel is always at the same
        place."""
        return self.tactile_pictures[self.tactile_picture[self._tactile_rows(steps)]]

    def _remembered(self, steps: Tensor) -> dict[str, Tensor]:
        """The memory in some steps, as inputs.Past gives it."""
        last = self.row[steps]
        begin, now = self.begin[last], self.commands[last][:, None]
        rows = torch.maximum(last[:, None] - torch.arange(REMEMBERED, device=self.device), begin[:, None])
        is_known, axes = (begin < last)[:, None, None], self.axes[last]
        states, commands = (turned(is_known * (numbers[rows] - now), axes) for numbers in (self.hand, self.commands))
        extremes = torch.stack([commands.amin(1), commands.amax(1)], 1)
        found = {"states": self.shares @ states, "commands": self.shares @ commands, "extremes": extremes}
        found = {key: self._blurred(numbers, self.fine) for key, numbers in found.items()}
        if TOUCH[self.shape.touch]:
            found["readings"] = self._blurred(self.shares @ self.readings[rows], self.fine_readings)
        found |= {"tactile": self._tactile(steps)} if self.shape.has_tactile_pictures else {}
        return found | {"seen": self.seen[last], "held": self.held[last]}

    def _noise(self, steps: Tensor) -> Tensor:
        """Noise of the state (B, 1, 7 or 8)."""
        noise = self.noise * torch.randn((len(steps), 1, self.shape.state), generator=self.random, device=self.device)
        if self.shape.has_memory:
            last = self.row[steps]
            later = self.actions[torch.minimum(steps + AHEAD, self.last[steps])]
            motion = (later - self.commands[last])[:, :3].norm(dim=1)
            noise[..., :6] *= ((self.begin[last] == last) * (SHARE * motion / STATE_NOISE[0]).clamp(max=1))[:, None, None]
        return noise

    def draw(self, count: int) -> tuple[dict[str, Tensor], Tensor, Tensor]:
        """Observations, chunks of actions (count, chunk, 7), and which of these lie within the demonstration."""
        steps = self.steps[torch.randint(len(self.steps), (count,), generator=self.random, device=self.device)]
        frames = self._frames(steps)
        obs = {"prompt": self.prompts[self.prompt[steps]]}
        for key, pictures in self.pictures.items():
            shifted = self._shifted(pictures[self.picture[frames]])
            light = 1 + BRIGHTNESS * (2 * torch.rand((count, 1, 1, 1, 1), generator=self.random, device=self.device) - 1)
            obs[key] = (shifted * light).clamp(0, 255).byte()
        noise = self._noise(steps)
        states = self.state[frames] + noise
        obs["state"] = (states - self.state_mean) / self.state_std
        if self.shape.has_markers:
            obs["touch"] = self.touch[self._past(steps, self.shape.touch_steps)].float()
        if self.shape.has_tactile_pictures:
            obs["tactile"] = self._tactile(steps)
        ahead = steps[:, None] + torch.arange(self.shape.chunk, device=self.device)
        future = self.actions[ahead.clamp(max=len(self.actions) - 1)]
        if self.shape.has_memory:
            obs |= self._remembered(steps)
            changes = fine(future - seen_reference(states[:, -1:], self.commands[self.row[steps]][:, None]), self.fine)
        else:
            changes = future - reference(states[:, -1:], self.shape.is_relative)
        return obs, (changes - self.action_mean) / self.action_std, ahead <= self.last[steps][:, None]

    def draw_feeling(self, count: int) -> tuple[dict[str, Tensor], Tensor, Tensor]:
        """As `draw`, of a hand that feels: its memory, and actions along its axes."""
        steps = self.feeling_steps[torch.randint(len(self.feeling_steps), (count,), generator=self.random, device=self.device)]
        obs = {"prompt": self.prompts[self.prompt[steps]]} | self._remembered(steps)
        noise = self.hidden * torch.randn((*obs["states"].shape[:2], 3), generator=self.random, device=self.device)
        for key in ("states", "commands"):
            obs[key][..., :3] += noise
        ahead = steps[:, None] + torch.arange(self.shape.chunk, device=self.device)
        future = self.actions[ahead.clamp(max=len(self.actions) - 1)]
        changes = fine(turned(future - self.commands[steps][:, None], self.axes[steps]), self.fine)
        return obs, (changes - self.felt_mean) / self.felt_std, ahead <= self.last[steps][:, None]


def train(demos: Demonstrations, options: TrainOptions, path: Path, about: dict) -> None:
    """Trains a policy and writes its checkpoint to `path`, with the log and the profile next to it."""
    began, times = time.monotonic(), ()
    torch.manual_seed(options.seed)
    torch.set_float32_matmul_precision("high")
    statistics = Statistics.of(demos, options.shape.chunk)
    batches = Batches(demos, statistics, options)
    policy = Policy(options.shape).to(options.device, memory_format=torch.channels_last)
    averaged = copy.deepcopy(policy).requires_grad_(False)
    even = {False: None}
    if options.shape.has_memory:
        for feels, own in ((False, statistics.action), (True, statistics.felt)):
            spread = Standard.of_each([demos.changes(ahead, feels) for ahead in range(options.shape.chunk)], LEAST_SPREAD).std
            even[feels] = torch.tensor(np.float32([own.mean, own.std, spread]), device=options.device)
    # The mode captures CUDA graphs: starting its kernels one by one takes longer than they run.
    loss_of = torch.compile(policy.loss, mode="reduce-overhead") if options.is_compiled else policy.loss
    optimizer = torch.optim.AdamW(policy.parameters(), RATE, weight_decay=WEIGHT_DECAY, fused=options.device.type == "cuda")

    most = options.steps

    def rate(step: int) -> float:
        cosine = LAST_RATE + (1 - LAST_RATE) * 0.5 * (1 + math.cos(math.pi * step / most))
        return min(1, (step + 1) / WARM_UP) * cosine

    schedule = torch.optim.lr_scheduler.LambdaLR(optimizer, rate)
    seeing = [value for name, value in policy.named_parameters() if not name.startswith("feeling.")]
    started, total, feeling_total = time.monotonic(), *torch.zeros((2, 2), device=options.device)
    with open(path.with_name(f"{path.name}.log"), "w") as log:
        step = 0
        while step < most:
            step += 1
            if step in TIMED and options.seconds < math.inf:
                torch.cuda.synchronize() if options.device.type == "cuda" else None
                times = (*times, time.monotonic()) if step > TIMED[0] else (time.monotonic(),)
                if step == TIMED[1]:
                    left = options.seconds - (times[1] - began)
                    most = max(step, min(most, int(step + left * (TIMED[1] - TIMED[0]) / (times[1] - times[0]))))
            obs, actions, is_step = batches.draw(options.batch)
            with torch.autocast(options.device.type, torch.bfloat16, enabled=options.device.type == "cuda"):
                loss = loss_of(obs, actions, is_step, even[False])
            loss[0].backward()
            torch.nn.utils.clip_grad_norm_(seeing, 1.0)
            if options.shape.has_memory:
                feeling_loss = policy.feeling_loss(*batches.draw_feeling(FEELING * options.batch), even[True])
                feeling_loss[0].backward()
                torch.nn.utils.clip_grad_norm_(policy.feeling.parameters(), 1.0)
                feeling_total += feeling_loss.detach()
            optimizer.step()
            optimizer.zero_grad(set_to_none=True)
            schedule.step()
            decay = min(AVERAGE, step / (step + 10))
            with torch.no_grad():
                torch._foreach_lerp_(list(averaged.parameters()), list(policy.parameters()), 1 - decay)
            total += loss.detach()
            if step % REPORT == 0 or step == most:
                count = (step - 1) % REPORT + 1
                loss, grip = (total / count).tolist()
                line = f"{path.stem}: step {step} of {most}, loss {loss:.4f}, gripper {grip:.4f}"
                if options.shape.has_memory:
                    loss, grip = (feeling_total / count).tolist()
                    line += f"; while the hand feels {loss:.4f}, gripper {grip:.4f}"
                line += f"; {time.monotonic() - started:.0f} s"
                print(line, flush=True)
                print(line, file=log, flush=True)
                total.zero_()
                feeling_total.zero_()
    about = about | {
        "steps": most,
        "batch": options.batch,
        "seed": options.seed,
        "recorded_steps": len(demos.state),
        "trained_steps": len(demos.actions),
    }
    save(path, Checkpoint(averaged, statistics, demos.prompts, about))
