"""The policy: pictures, state, prompt and touch as tokens of a transformer that answers a chunk of actions.

The architecture is that of ACT (Zhao et al., 2023) without its latent variable. With the head `flow` the decoder turns noise into actions
in a few steps (flow matching, Lipman et al., 2023) instead of regressing them.
"""

import torch
from torch import Tensor, nn
from torchvision.models import resnet18

from . import prompts
from .data import MARKERS
from .inputs import Shape
from .numbers import GRIPPER

# Steps of the integration of a flow.
FLOW_STEPS = 10


def _pictures_encoder() -> nn.Module:
    """ResNet-18 (He et al., 2016) with group normalisation, up to its last map of 512 channels."""
    net = resnet18(norm_layer=lambda channels: nn.GroupNorm(channels // 16, channels))
    return nn.Sequential(*list(net.children())[:-2])


class Tokens(nn.Module):
    """Observation tokens."""

    def __init__(self, shape: Shape):
        super().__init__()
        self.shape = shape
        width, cells = shape.width, (shape.edge // 32) ** 2
        self.pictures = nn.ModuleDict({key: _pictures_encoder() for key in shape.pictures})
        self.project = nn.ModuleDict({key: nn.Linear(512, width) for key in shape.pictures})
        self.place = nn.ParameterDict({key: nn.Parameter(0.02 * torch.randn(shape.frames, cells, width)) for key in shape.pictures})
        self.state = nn.Sequential(nn.Linear(shape.state, width), nn.GELU(), nn.Linear(width, width))
        self.state_place = nn.Parameter(0.02 * torch.randn(shape.frames, width))
        # N-grams that were never trained add nothing, since all start at zero.
        self.ngrams = nn.EmbeddingBag(prompts.BUCKETS, width, mode="sum", padding_idx=0)
        nn.init.zeros_(self.ngrams.weight)
        self.prompt = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width))
        if shape.has_touch:
            self.touch = nn.Sequential(nn.Linear(MARKERS, 2 * width), nn.GELU(), nn.Linear(2 * width, width))
            self.touch_place = nn.Parameter(0.02 * torch.randn(len(shape.marker_steps), width))

    def forward(self, obs: dict[str, Tensor]) -> Tensor:
        """Tokens (B, T, width) of pictures (B, frames, edge, edge, 3) uint8, standardised states (B, frames, 7 or 8), prompt
        buckets (B, L), and with touch scaled markers (B, steps, 396)."""
        tokens = []
        for key, net in self.pictures.items():
            batch, frames = obs[key].shape[:2]
            planes = obs[key].flatten(0, 1).permute(0, 3, 1, 2).float() / 127.5 - 1
            cells = net(planes.contiguous(memory_format=torch.channels_last)).flatten(2).transpose(1, 2)
            cells = self.project[key](cells).unflatten(0, (batch, frames)) + self.place[key]
            tokens.append(cells.flatten(1, 2))
        tokens.append(self.state(obs["state"]) + self.state_place)
        tokens.append(self.prompt(self.ngrams(obs["prompt"])).unsqueeze(1))
        if self.shape.has_touch:
            # A firm grasp moves the markers ten times as far as a first contact, which is to be seen as well.
            tokens.append(self.touch(obs["markers"].asinh()) + self.touch_place)
        return torch.cat(tokens, 1)


class Policy(nn.Module):
    """Answers a chunk of standardised actions (B, chunk, 7)."""

    def __init__(self, shape: Shape):
        super().__init__()
        self.shape = shape
        width = shape.width
        self.tokens = Tokens(shape)
        options = dict(nhead=8, dim_feedforward=4 * width, dropout=0.1, activation="gelu", batch_first=True, norm_first=True)
        self.encoder = nn.TransformerEncoder(
            nn.TransformerEncoderLayer(width, **options), shape.layers, nn.LayerNorm(width), enable_nested_tensor=False
        )
        self.decoder = nn.TransformerDecoder(nn.TransformerDecoderLayer(width, **options), shape.layers, nn.LayerNorm(width))
        self.queries = nn.Parameter(0.02 * torch.randn(shape.chunk, width))
        self.answer = nn.Linear(width, shape.action)
        if shape.head == "flow":
            self.noisy = nn.Linear(shape.action, width)
            self.time = nn.Sequential(nn.Linear(64, width), nn.GELU(), nn.Linear(width, width))

    def _decode(self, memory: Tensor, noisy: Tensor | None = None, time: Tensor | None = None) -> Tensor:
        queries = self.queries.expand(len(memory), -1, -1)
        if noisy is not None:
            waves = time[:, None] * torch.exp2(torch.arange(32, device=time.device) * 0.25)
            queries = queries + self.noisy(noisy) + self.time(torch.cat([waves.sin(), waves.cos()], 1))[:, None]
        return self.answer(self.decoder(queries, memory))

    def loss(self, obs: dict[str, Tensor], actions: Tensor, is_step: Tensor) -> Tensor:
        """Mean error (2,) of all numbers and of the gripper's alone, over the steps of a chunk that lie within the demonstration;
        `is_step` is (B, chunk)."""
        memory = self.encoder(self.tokens(obs))
        if self.shape.head == "regression":
            error = (self._decode(memory) - actions).abs()
        else:
            noise, time = torch.randn_like(actions), torch.rand(len(actions), device=actions.device)
            noisy = torch.lerp(noise, actions, time[:, None, None])
            error = (self._decode(memory, noisy, time) - (actions - noise)).square()
        both = torch.stack([error.mean(-1), error[..., GRIPPER]])
        return (both * is_step).sum((1, 2)) / is_step.sum()

    @torch.no_grad()
    def act(self, obs: dict[str, Tensor], noise: Tensor) -> Tensor:
        """The chunk for an observation. Only a flow uses `noise` (B, chunk, 7)."""
        memory = self.encoder(self.tokens(obs))
        if self.shape.head == "regression":
            return self._decode(memory)
        actions = noise
        for step in range(FLOW_STEPS):
            time = torch.full((len(actions),), step / FLOW_STEPS, device=actions.device)
            actions = actions + self._decode(memory, actions, time) / FLOW_STEPS
        return actions
