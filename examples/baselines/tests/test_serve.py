"""The server's protocol, with answers that need no learning library."""

import asyncio
import unittest

import numpy as np
from openpi_client import msgpack_numpy
from websockets.asyncio.client import connect

from softvt_baselines import UserError
from softvt_baselines.serve import Request, serve

PORT = 18790


def answer(request: Request):
    """The number of an observation, and 100 more if the connection has asked before in the episode."""
    if request.obs["prompt"] == "fly":
        return UserError("no such prompt")
    return np.full((2, 7), request.obs["number"] + (100 if request.last else 0), np.float32)


def answers(batch: list[Request]) -> list:
    return [answer(request) for request in batch]


async def ask(prompt: str, number: float, steps: tuple[int, ...] = (0,)) -> tuple[dict, object]:
    """The metadata, and the last reply to observations at some control steps: an array or a text."""
    async with connect(f"ws://127.0.0.1:{PORT}", compression=None) as socket:
        metadata = msgpack_numpy.unpackb(await socket.recv())
        for step in steps:
            await socket.send(msgpack_numpy.packb({"prompt": prompt, "number": number, "softvt": {"step": step}}))
            reply = await socket.recv()
        return metadata, reply if isinstance(reply, str) else msgpack_numpy.unpackb(reply)["actions"]


class Serving(unittest.IsolatedAsyncioTestCase):
    async def test_every_connection_gets_its_own_answer_or_its_own_error(self):
        server = asyncio.create_task(serve(answers, 4, {"gripper": "force"}, "127.0.0.1", PORT))
        await asyncio.sleep(0.2)
        replies = await asyncio.gather(*(ask("fly" if number == 5 else "take it", number) for number in range(10)))
        later = [await ask("take it", 1, steps) for steps in [(0, 4), (0, 4, 0)]]
        server.cancel()
        self.assertEqual([reply[0, 0] for _, reply in later], [101, 1])
        for number, (metadata, reply) in enumerate(replies):
            self.assertEqual(metadata, {"gripper": "force"})
            if number == 5:
                self.assertEqual(reply, "no such prompt")
            else:
                np.testing.assert_array_equal(reply, np.full((2, 7), number))


if __name__ == "__main__":
    unittest.main()
