"""softvt as a Gymnasium environment: a client of `softvt serve` (docs/serve.md).

    pip install numpy gymnasium msgpack websocket-client

    env = SoftVTEnv.launch("suites/object_soft.lua", "--profile", "vision")   # or SoftVTEnv("ws://127.0.0.1:8765")
    observation, info = env.reset(seed=0, options={"task": 3})
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    env.close()

Observations are a dict with the keys of the server's profile; actions are seven numbers in its encoding. The reward is 1 in the
step that reaches the goal and 0 otherwise. `info` has the step, the success and the numbers of actions out of reach (`far_commands`) and of grip values out of range
(`clamped_grips`), and with --privileged the true state.
"""

import atexit
import subprocess
from urllib.parse import urlsplit

import gymnasium
import msgpack
import numpy as np
from gymnasium import spaces
from websocket import WebSocketException, create_connection


class SoftVTEnv(gymnasium.Env):
    """An environment with its own connection. Several environments may share a server."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(self, url="ws://127.0.0.1:8765", render_mode=None, camera=None, token=None):
        """`camera` selects the image of `render`: a camera's name (default: the scene's first), or "left" or "right" for a finger.

        `token` is that of a server with `--token`.
        """
        self.url, self.render_mode, self.camera = url, render_mode, camera
        self._server = None
        self._socket = _connect(url, token)
        self.about = self._receive()
        self.observation_space = spaces.Dict({key: _space(entry) for key, entry in self.about["observation_space"].items()})
        self.action_space = _space(self.about["action_space"])
        self._next = {"task": 0, "episode": 0}

    @classmethod
    def launch(cls, script, *flags, softvt="softvt", **arguments):
        """Starts a server that ends with the environment, or with this process. `flags` are arguments of `softvt serve`."""
        command = [softvt, "serve", script, "--port", "0", "--until-stdin-closes", *flags]
        # The system closes the pipe however this process ends, and the server ends with the pipe.
        server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        url = server.stdout.readline().strip()
        if not url:
            raise RuntimeError(f"softvt serve ended with exit code {server.wait()}; its message is above")
        try:
            env = cls(url, **arguments)
        except BaseException:
            _end(server)
            raise
        env._server = server
        atexit.register(env.close)
        return env

    def reset(self, *, seed=None, options=None):
        """Starts an episode. `options` may give suite, task, episode and split, which also apply to later episodes.

        The seed is that of a whole run: with a seed, the episode is 0 unless given; without one, it is the next episode.
        """
        super().reset(seed=seed)
        requested = dict(self._next)
        if seed is not None:
            requested.update(seed=seed, episode=0)
        requested.update(options or {})
        response = self._request("reset", **requested)
        self._next = dict(requested, episode=requested["episode"] + 1)
        return response["observation"], response["info"]

    def step(self, action):
        """Executes an action of shape (7), or several of shape (n, 7), and returns the result of the last one."""
        response = self._request("step", action=np.asarray(action, dtype=np.float64))
        flags = response["terminated"], response["truncated"]
        return response["observation"], response["reward"], *flags, response["info"]

    def render(self):
        """Image of the camera, uint8 (height, width, 3)."""
        return self._request("render", camera=self.camera)["image"] if self.render_mode else None

    def get_state(self):
        """State of the episode as plain data, for `set_state` of this or an equal server."""
        return self._request("get_state")["state"]

    def set_state(self, state):
        """Restores a state bit for bit; returns what `reset` does."""
        response = self._request("set_state", state=state)
        return response["observation"], response["info"]

    def close(self):
        """Closes the connection, and ends the server if `launch` started it."""
        socket, self._socket = self._socket, None
        server, self._server = self._server, None
        if socket is not None:
            socket.close()
        if server is not None:
            atexit.unregister(self.close)
            _end(server)

    def _request(self, kind, **fields):
        if self._socket is None:
            raise RuntimeError("the environment is closed")
        self._socket.send_binary(msgpack.packb({"type": kind, **fields}, default=_pack))
        return self._receive()

    def _receive(self):
        response = msgpack.unpackb(self._socket.recv(), object_hook=_unpack)
        if response["type"] == "error":
            raise RuntimeError(response["error"])
        return response


def _connect(url, token):
    try:
        return create_connection(url, header={"Authorization": f"Bearer {token}"} if token else {})
    except (OSError, WebSocketException) as error:
        port = urlsplit(url).port or 80
        raise ConnectionError(
            f"no softvt server answers at {url} ({error}); start one with `softvt serve FILE.lua --port {port}`, "
            "or with SoftVTEnv.launch(FILE.lua)"
        ) from error


def _end(server):
    server.stdin.close()
    try:
        server.wait(timeout=60)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()
    server.stdout.close()


def _space(entry):
    """Gymnasium space of the server's description: text, or an array with common or individual bounds."""
    if "charset" in entry:
        return spaces.Text(entry["max_length"], charset=entry["charset"])
    dtype, shape = np.dtype(entry["dtype"]), tuple(entry["shape"])
    low, high = (np.broadcast_to(np.array(entry[end], dtype), shape) for end in ("low", "high"))
    return spaces.Box(low, high, shape, dtype.type)


def _pack(value):
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        data = {b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
        return {b"__ndarray__": True, **data}
    raise TypeError(f"a {type(value).__name__} cannot be sent")


def _unpack(entry):
    if b"__ndarray__" not in entry:
        return entry
    return np.frombuffer(entry[b"data"], entry[b"dtype"]).reshape(entry[b"shape"]).copy()


gymnasium.register(id="softvt/Suite-v0", entry_point=SoftVTEnv)
