"""A client of `softvt serve`: episodes that are stepped from here."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from openpi_client import msgpack_numpy
from websockets.sync.client import connect

from . import UserError
from .evaluate import softvt_binary


@contextmanager
def serving(suite: str, flags: list[str]) -> Iterator[str]:
    """A server of a suite in a process of its own; gives its address."""
    words = [softvt_binary(), "serve", suite, "--port", "0", "--until-stdin-closes", *flags]
    server = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        address = server.stdout.readline().strip()
        if not address:
            raise UserError(f"softvt serve {suite} ended with exit code {server.wait()}")
        yield address
    finally:
        server.stdin.close()
        server.wait()


class Client:
    """A connection, with an episode of its own."""

    def __init__(self, address: str):
        self.socket = connect(address, compression=None, max_size=64 << 20, ping_interval=None)
        self._receive()  # its greeting

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_) -> None:
        self.socket.close()

    def reset(self, task: int, episode: int) -> dict:
        """Starts an episode of the server's seed. Returns its first observation."""
        return self._request("reset", task=task, episode=episode)["observation"]

    def step(self, actions: np.ndarray) -> dict:
        """Executes actions (n, 7). Returns the response after the last one: see docs/serve.md."""
        return self._request("step", actions=np.asarray(actions, np.float64))

    def _request(self, kind: str, **fields) -> dict:
        self.socket.send(msgpack_numpy.packb({"type": kind, **fields}))
        return self._receive()

    def _receive(self) -> dict:
        response = msgpack_numpy.unpackb(self.socket.recv())
        if response["type"] == "error":
            raise UserError(f"softvt serve: {response['error']}")
        return response
