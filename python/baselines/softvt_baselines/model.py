"""The policy: pictures, state, prompt and touch as tokens of a transformer that answers a chunk of actions.

The architecture is that of ACT (Zhao et al., 2023) without its latent variable. With the head `flow` the decoder turns noise into actions
in a few steps (flow matching, Lipman et al., 2023) instead of regressing them.
"""

import torch
from torch import Tensor, nn
from torchvision.models import resnet18
from torchvision.models.resnet import BasicBlock

from . import prompts
from .data import MARKERS
from .inputs import INTERVALS, TOUCH, Shape
from .numbers import FINE, FINE_READINGS, GRIPPER, coarse, fine

# Steps of the integration of a flow.
FLOW_STEPS = 10
# Width of the layers that read the memory, tokens that they give, and share of the numbers that are left out in training.
MEMORY_WIDTH, MEMORY_TOKENS, DROPOUT = 1024, 4, 0.1
# Readings relative to their mean over the last intervals (6 steps), which is taken to be at least 4 times FINE_READINGS.
PRESENT, LEAST_PRESENT, MOST_RATIO = 4, 4, 5
# Pixels of a picture along an edge of a cell of its last map.
CELL = 16
# Channels of the stages of the encoder of tactile pictures, cells along an edge of its last map, and numbers of a picture for a hand that feels.
TACTILE_CHANNELS, TACTILE_CELLS, FELT = (16, 32, 64, 128), 4, 64
# Largest number on the fine scale whose change is looked at in training: 4 m.
MOST = 12


def _pictures_encoder() -> nn.Module:
    """ResNet-18 (He et al., 2016) with group normalisation, up to its last map of 512 channels. Its last stage keeps the resolution, since
    a hand has to reach an object to a few millimetres, of which a cell of 32 pixels covers many."""
    net = resnet18(norm_layer=lambda channels: nn.GroupNorm(channels // 16, channels))
    for layer in (net.layer4[0].conv1, net.layer4[0].downsample[0]):
        layer.stride = (1, 1)
    return nn.Sequential(*list(net.children())[:-2])


def _tactile_encoder() -> nn.Module:
    """As the encoder of the other pictures, with one block per stage and a quarter of the channels: a gel fills its picture and is always at
    the same place."""
    first, *others = TACTILE_CHANNELS

    def norm(channels: int) -> nn.Module:
        return nn.GroupNorm(channels // 16, channels)

    layers = [nn.Conv2d(3, first, 7, 2, 3, bias=False), norm(first), nn.ReLU(inplace=True)]
    for before, channels in zip(TACTILE_CHANNELS, others):
        shortcut = nn.Sequential(nn.Conv2d(before, channels, 1, 2, bias=False), norm(channels))
        layers.append(BasicBlock(before, channels, 2, shortcut, norm_layer=norm))
    return nn.Sequential(*layers)


def _planes(pictures: Tensor) -> Tensor:
    """Pictures (..., h, w, 3) uint8 as planes (N, 3, h, w) from -1 to 1."""
    planes = pictures.flatten(0, -4).permute(0, 3, 1, 2).float() / 127.5 - 1
    return planes.contiguous(memory_format=torch.channels_last)


class Memory(nn.Module):
    """Numbers of the remembered states and commands, and of what is remembered of the fingers with touch."""

    def __init__(self, touch: str):
        super().__init__()
        self.touch = touch
        self.register_buffer("scale", torch.from_numpy(FINE), persistent=False)
        self.register_buffer("readings_scale", torch.from_numpy(FINE_READINGS), persistent=False)
        # The readings are also seen relative to their mean.
        self.count = 1 + (2 * INTERVALS + 2) * 7 + INTERVALS * TOUCH[touch] * (2 if touch == "markers" else 1)

    def forward(self, obs: dict[str, Tensor]) -> Tensor:
        """Numbers (B, count) of changes of states and commands (B, intervals, 7), their extremes (B, 2, 7) and readings (B, intervals, n),
        and whether the hand holds what it has felt (B, 1)."""
        parts = [fine(obs[key].float(), self.scale) for key in ("states", "commands", "extremes")]
        if self.touch == "contact":
            parts.append(obs["readings"].float())
        if self.touch == "markers":
            felt = obs["readings"].float()
            present = felt[:, :PRESENT].mean(1, keepdim=True).abs()
            # Readings of a gel that slides and of one that is held differ by a few per cent.
            ratios = felt / torch.maximum(present, LEAST_PRESENT * self.readings_scale)
            parts += [fine(felt, self.readings_scale), 3 * ratios.clamp(-MOST_RATIO, MOST_RATIO)]
        return torch.cat([obs["held"].float(), *(0.3 * part.flatten(1) for part in parts)], 1)


class Remembering(nn.Module):
    """Tokens of the memory."""

    def __init__(self, width: int, touch: str):
        super().__init__()
        self.memory, hidden = Memory(touch), MEMORY_WIDTH
        self.net = nn.Sequential(
            nn.Linear(self.memory.count, hidden), nn.GELU(), nn.Linear(hidden, hidden), nn.GELU(), nn.Linear(hidden, MEMORY_TOKENS * width)
        )

    def forward(self, obs: dict[str, Tensor]) -> Tensor:
        # Half precision would lose small changes of large values.
        with torch.autocast(obs["states"].device.type, enabled=False):
            return self.net(self.memory(obs)).unflatten(1, (MEMORY_TOKENS, -1))


class Feeling(nn.Module):
    """Answers while the hand feels, along its axes, from the memory, the prompt and tactile pictures, if they are seen: a grip that the
    pictures of the cameras do not tell could still be learned by heart from them, since every demonstration looks different."""

    def __init__(self, shape: Shape):
        super().__init__()
        self.shape, width = shape, MEMORY_WIDTH
        self.ngrams = nn.EmbeddingBag(prompts.BUCKETS, 32, mode="sum", padding_idx=0)
        nn.init.zeros_(self.ngrams.weight)
        self.memory = Memory(shape.touch)
        count, answers = self.memory.count + 32, shape.chunk * shape.action
        if shape.has_tactile_pictures:
            cells = TACTILE_CHANNELS[-1] * TACTILE_CELLS**2
            self.tactile = nn.Sequential(_tactile_encoder(), nn.Flatten(), nn.Linear(cells, FELT))
            count += FELT * 2 * len(shape.touch_steps)
        self.first = nn.Linear(count, width)
        self.layers = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.GELU(), nn.Dropout(DROPOUT), nn.Linear(width, width))
            for _ in range(3)
        )
        self.last = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, answers))
        # To return to a remembered command is exact this way.
        self.direct = nn.Linear(count, answers)

    def forward(self, obs: dict[str, Tensor]) -> Tensor:
        with torch.autocast(obs["states"].device.type, enabled=False):
            numbers = torch.cat([self.memory(obs), self.ngrams(obs["prompt"])], 1)
            if self.shape.has_tactile_pictures:
                numbers = torch.cat([numbers, self.tactile(_planes(obs["tactile"])).unflatten(0, (len(numbers), -1)).flatten(1)], 1)
            found = self.first(numbers)
            for layer in self.layers:
                found = found + layer(found)
            return (self.last(found) + self.direct(numbers)).unflatten(1, (self.shape.chunk, self.shape.action))


class Tokens(nn.Module):
    """Observation tokens."""

    def __init__(self, shape: Shape):
        super().__init__()
        self.shape = shape
        width, cells = shape.width, (shape.edge // CELL) ** 2
        self.pictures = nn.ModuleDict({key: _pictures_encoder() for key in shape.pictures})
        self.project = nn.ModuleDict({key: nn.Linear(512, width) for key in shape.pictures})
        self.place = nn.ParameterDict({key: nn.Parameter(0.02 * torch.randn(shape.frames, cells, width)) for key in shape.pictures})
        self.state = nn.Sequential(nn.Linear(shape.state, width), nn.GELU(), nn.Linear(width, width))
        self.state_place = nn.Parameter(0.02 * torch.randn(shape.frames, width))
        # N-grams that were never trained add nothing, since all start at zero.
        self.ngrams = nn.EmbeddingBag(prompts.BUCKETS, width, mode="sum", padding_idx=0)
        nn.init.zeros_(self.ngrams.weight)
        self.prompt = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width))
        if shape.has_markers:
            count = TOUCH["contact"] if shape.touch == "contact" else MARKERS
            self.touch = nn.Sequential(nn.Linear(count, 2 * width), nn.GELU(), nn.Linear(2 * width, width))
            self.touch_place = nn.Parameter(0.02 * torch.randn(len(shape.touch_steps), width))
        if shape.has_tactile_pictures:
            self.tactile, self.project_tactile = _tactile_encoder(), nn.Linear(TACTILE_CHANNELS[-1], width)
            self.tactile_place = nn.Parameter(0.02 * torch.randn(2 * len(shape.touch_steps), TACTILE_CELLS**2, width))
        if shape.has_memory:
            self.memory = Remembering(width, shape.touch)

    def forward(self, obs: dict[str, Tensor]) -> Tensor:
        """Tokens (B, T, width) of pictures (B, frames, edge, edge, 3) uint8, standardised states (B, frames, 7 or 8), prompt
        buckets (B, L), and of touch (B, steps, n) scaled markers or contacts, or tactile pictures (B, steps, *CELLS)."""
        tokens = []
        for key, net in self.pictures.items():
            batch, frames = obs[key].shape[:2]
            cells = net(_planes(obs[key])).flatten(2).transpose(1, 2)
            cells = self.project[key](cells).unflatten(0, (batch, frames)) + self.place[key]
            tokens.append(cells.flatten(1, 2))
        # Half precision would round positions to a millimetre.
        with torch.autocast(obs["state"].device.type, enabled=False):
            tokens.append(self.state(obs["state"].float()) + self.state_place)
        tokens.append(self.prompt(self.ngrams(obs["prompt"])).unsqueeze(1))
        if self.shape.has_markers:
            # A firm grasp moves the markers ten times as far as a first contact, which is to be seen as well.
            tokens.append(self.touch(obs["touch"].asinh()) + self.touch_place)
        if self.shape.has_tactile_pictures:
            cells = self.project_tactile(self.tactile(_planes(obs["tactile"])).flatten(2).transpose(1, 2))
            tokens.append((cells.unflatten(0, (len(obs["tactile"]), -1)) + self.tactile_place).flatten(1, 2))
        if self.shape.has_memory:
            tokens.append(self.memory(obs))
        return torch.cat(tokens, 1)


class Policy(nn.Module):
    """Answers a chunk of standardised actions (B, chunk, 7)."""

    def __init__(self, shape: Shape):
        super().__init__()
        self.shape = shape
        width = shape.width
        self.tokens = Tokens(shape)
        self.register_buffer("fine", torch.from_numpy(FINE), persistent=False)
        options = dict(nhead=8, dim_feedforward=4 * width, dropout=0.1, activation="gelu", batch_first=True, norm_first=True)
        self.encoder = nn.TransformerEncoder(
            nn.TransformerEncoderLayer(width, **options), shape.layers, nn.LayerNorm(width), enable_nested_tensor=False
        )
        self.decoder = nn.TransformerDecoder(nn.TransformerDecoderLayer(width, **options), shape.layers, nn.LayerNorm(width))
        self.queries = nn.Parameter(0.02 * torch.randn(shape.chunk, width))
        self.answer = nn.Linear(width, shape.action)
        if shape.has_memory:
            self.feeling = Feeling(shape)
        if shape.head == "flow":
            self.noisy = nn.Linear(shape.action, width)
            self.time = nn.Sequential(nn.Linear(64, width), nn.GELU(), nn.Linear(width, width))

    def _decode(self, memory: Tensor, noisy: Tensor | None = None, time: Tensor | None = None) -> Tensor:
        queries = self.queries.expand(len(memory), -1, -1)
        if noisy is not None:
            waves = time[:, None] * torch.exp2(torch.arange(32, device=time.device) * 0.25)
            queries = queries + self.noisy(noisy) + self.time(torch.cat([waves.sin(), waves.cos()], 1))[:, None]
        return self.answer(self.decoder(queries, memory))

    def loss(self, obs: dict[str, Tensor], actions: Tensor, is_step: Tensor, even: Tensor | None = None) -> Tensor:
        """Mean error (2,) of all numbers and of the gripper's alone, over the steps of a chunk that lie within the demonstration;
        `is_step` is (B, chunk). On the fine scale the arm's long ways would count for little: `even` (3, chunk, 7), the mean and the
        deviation of the numbers on the fine scale and the deviation of the changes themselves, adds the error of the changes."""
        memory = self.encoder(self.tokens(obs))
        if self.shape.head == "regression":
            error = self._error(self._decode(memory).float(), actions, even)
        else:
            noise, time = torch.randn_like(actions), torch.rand(len(actions), device=actions.device)
            noisy = torch.lerp(noise, actions, time[:, None, None])
            error = (self._decode(memory, noisy, time) - (actions - noise)).square()
        return _means(error, is_step)

    def _error(self, answers: Tensor, actions: Tensor, even: Tensor | None) -> Tensor:
        error = (answers - actions).abs()
        if even is None:
            return error
        mean, std, spread = even
        found, wanted = (coarse((part * std + mean).clamp(-MOST, MOST), self.fine) / spread for part in (answers, actions))
        return error + (found - wanted).abs()

    def feeling_loss(self, obs: dict[str, Tensor], actions: Tensor, is_step: Tensor, even: Tensor) -> Tensor:
        """As `loss`, of the answers while the hand feels."""
        return _means(self._error(self.feeling(obs), actions, even), is_step)

    @torch.no_grad()
    def act(self, obs: dict[str, Tensor], noise: Tensor) -> Tensor:
        """The chunk for an observation. Only a flow uses `noise` (B, chunk, 7)."""
        answers = self._answers(obs, noise)
        if not self.shape.has_memory:
            return answers
        return torch.where(obs["seen"][:, None, None] > 0, answers, self.feeling(obs))

    def _answers(self, obs: dict[str, Tensor], noise: Tensor) -> Tensor:
        memory = self.encoder(self.tokens(obs))
        if self.shape.head == "regression":
            return self._decode(memory)
        actions = noise
        for step in range(FLOW_STEPS):
            time = torch.full((len(actions),), step / FLOW_STEPS, device=actions.device)
            actions = actions + self._decode(memory, actions, time) / FLOW_STEPS
        return actions


def _means(error: Tensor, is_step: Tensor) -> Tensor:
    """Mean (2,) of errors (B, chunk, 7) over the valid steps: of all numbers and of the gripper's alone."""
    both = torch.stack([error.mean(-1), error[..., GRIPPER]])
    return (both * is_step).sum((1, 2)) / is_step.sum()
