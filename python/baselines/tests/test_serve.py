"""The server's protocol, with answers that need no learning library."""

import asyncio
import unittest

import numpy as np
from openpi_client import msgpack_numpy
from softvt_baselines import UserError
from softvt_baselines.serve import Request, serve
from websockets.asyncio.client import connect

PORT = 18790


def answer(request: Request):
    """The number of an observation, and 100 more if there was an answer before in the episode."""
    if request.obs["prompt"] == "break":
        raise ZeroDivisionError
    if request.obs["prompt"] == "fly":
        return UserError("no such prompt")
    return np.full((2, 7), request.obs["number"] + (100 if request.last else 0), np.float32)


def answers(batch: list[Request]) -> list:
    return [answer(request) for request in batch]


async def ask(prompt: str, number: float, steps: tuple[tuple[int, int], ...] = ((0, 0),)) -> tuple[dict, object]:
    """The metadata, and the last reply to observations of some episodes and control steps: an array or a text."""
    async with connect(f"ws://127.0.0.1:{PORT}", compression=None) as socket:
        metadata = msgpack_numpy.unpackb(await socket.recv())
        for episode, step in steps:
            softvt = {"suite": "s", "run_seed": 0, "task": number, "episode": episode, "step": step}
            await socket.send(msgpack_numpy.packb({"prompt": prompt, "number": number, "softvt": softvt}))
            reply = await socket.recv()
        return metadata, reply if isinstance(reply, str) else msgpack_numpy.unpackb(reply)["actions"]


class Serving(unittest.IsolatedAsyncioTestCase):
    async def test_every_connection_gets_its_own_answer_or_its_own_error(self):
        server = asyncio.create_task(serve(answers, 4, {"gripper": "force"}, "127.0.0.1", PORT))
        await asyncio.sleep(0.2)
        replies = await asyncio.gather(*(ask("fly" if number == 5 else "take it", number) for number in range(10)))
        later = [await ask("take it", 20, steps) for steps in [((0, 0), (0, 4)), ((0, 8),), ((1, 8),), ((0, 12), (0, 0))]]
        failed = await ask("break", 30)
        self.assertIn("ZeroDivisionError", failed[1])
        server.cancel()
        self.assertEqual([reply[0, 0] for _, reply in later], [120, 120, 20, 20])
        for number, (metadata, reply) in enumerate(replies):
            self.assertEqual(metadata, {"gripper": "force"})
            if number == 5:
                self.assertEqual(reply, "no such prompt")
            else:
                np.testing.assert_array_equal(reply, np.full((2, 7), number))


if __name__ == "__main__":
    unittest.main()
