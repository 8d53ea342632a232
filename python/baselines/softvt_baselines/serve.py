"""A policy server in openpi's protocol: metadata first, then a chunk of actions per observation.

Observations of all connections that wait at the same time are answered together.
"""

import asyncio
import traceback
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from openpi_client import msgpack_numpy
from websockets.asyncio.server import serve as listen
from websockets.exceptions import ConnectionClosed

from . import UserError

# Episodes whose last answers are kept.
EPISODES = 4096


@dataclass
class Plan:
    """The last answer in an episode."""

    step: int  # control step of its first action
    actions: np.ndarray  # (chunk, 7)
    memory: object = None  # what a policy remembers of the episode


@dataclass
class Request:
    """An observation, and the answer to the one before it; None at the start of an episode. A policy may leave a memory for the
    next request of the episode."""

    obs: dict
    last: Plan | None
    memory: object = None


# Answers a batch of requests: a chunk of actions each, or an error for its client.
Answers = Callable[[list[Request]], list[np.ndarray | UserError]]


@dataclass
class _Pending:
    request: Request
    answer: asyncio.Future


async def _answer_all(queue: asyncio.Queue, answers: Answers, batch_size: int) -> None:
    while True:
        batch = [await queue.get()]
        while len(batch) < batch_size and not queue.empty():
            batch.append(queue.get_nowait())
        try:
            found = await asyncio.to_thread(answers, [pending.request for pending in batch])
        except Exception as error:
            traceback.print_exc()
            found = [UserError(f"the policy failed: {type(error).__name__}: {error}")] * len(batch)
        for pending, answer in zip(batch, found, strict=True):
            if not pending.answer.cancelled():
                pending.answer.set_result(answer)


async def serve(answers: Answers, batch_size: int, metadata: dict, host: str, port: int) -> None:
    """Serves the policies of one run at a time until it is cancelled. Port 0 takes a free one; the first line of output names it.

    Raises UserError if the address is not free or not valid.
    """
    queue: asyncio.Queue[_Pending] = asyncio.Queue()
    # By suite, seed, task and episode: softvt may continue an episode over another connection.
    plans: dict[tuple, Plan] = {}

    async def converse(socket) -> None:
        try:
            await socket.send(msgpack_numpy.packb(metadata))
            async for message in socket:
                obs = msgpack_numpy.unpackb(message)
                query = obs.get("softvt", {})
                step, episode = query.get("step", 0), tuple(query.get(key) for key in ("suite", "run_seed", "task", "episode"))
                last = plans.pop(episode, None)
                request = Request(obs, last if step > 0 else None)
                pending = _Pending(request, asyncio.get_running_loop().create_future())
                await queue.put(pending)
                answer = await pending.answer
                if isinstance(answer, UserError):
                    await socket.send(str(answer))  # text is an error message
                    return
                await socket.send(msgpack_numpy.packb({"actions": answer}))
                plans[episode] = Plan(step, answer, request.memory)
                if len(plans) > EPISODES:
                    del plans[next(iter(plans))]
        except ConnectionClosed:
            return
        except Exception:
            await socket.send(traceback.format_exc())
            raise

    try:
        server = await listen(converse, host, port, compression=None, max_size=64 << 20, ping_interval=None)
    except (OSError, OverflowError) as error:
        raise UserError(f"cannot serve on {host}, port {port}: {error}") from None
    async with server:
        print(f"serving on ws://{host}:{server.sockets[0].getsockname()[1]}", flush=True)
        await _answer_all(queue, answers, batch_size)
