"""The server's protocol, with answers that need no learning library."""

import asyncio
import unittest

import numpy as np
from openpi_client import msgpack_numpy
from websockets.asyncio.client import connect

from softvt_baselines import UserError
from softvt_baselines.serve import serve

PORT = 18790


def answers(batch: list[dict]) -> list:
    return [UserError("no such prompt") if obs["prompt"] == "fly" else np.full((2, 7), obs["number"], np.float32) for obs in batch]


async def ask(prompt: str, number: float) -> tuple[dict, object]:
    """The metadata, and the reply to one observation: an array or a text."""
    async with connect(f"ws://127.0.0.1:{PORT}", compression=None) as socket:
        metadata = msgpack_numpy.unpackb(await socket.recv())
        await socket.send(msgpack_numpy.packb({"prompt": prompt, "number": number}))
        reply = await socket.recv()
        return metadata, reply if isinstance(reply, str) else msgpack_numpy.unpackb(reply)["actions"]


class Serving(unittest.IsolatedAsyncioTestCase):
    async def test_every_connection_gets_its_own_answer_or_its_own_error(self):
        server = asyncio.create_task(serve(answers, 4, {"gripper": "force"}, "127.0.0.1", PORT))
        await asyncio.sleep(0.2)
        replies = await asyncio.gather(*(ask("fly" if number == 5 else "take it", number) for number in range(10)))
        server.cancel()
        for number, (metadata, reply) in enumerate(replies):
            self.assertEqual(metadata, {"gripper": "force"})
            if number == 5:
                self.assertEqual(reply, "no such prompt")
            else:
                np.testing.assert_array_equal(reply, np.full((2, 7), number))


if __name__ == "__main__":
    unittest.main()
