"""softvt as a Gymnasium environment: a client of `softvt serve` (docs/serve.md).

    pip install numpy gymnasium msgpack websocket-client

    env = SoftVTEnv.launch("suites/object_soft.lua", "--profile", "vision")   # or SoftVTEnv("ws://127.0.0.1:8765")
    observation, info = env.reset(seed=0, options={"task": 3})
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    env.close()

Observations are a dict with the keys of the server's profile, actions seven numbers in its code. The reward is 1 in the step
that reaches the goal, and 0 in all others. What else can be known, with --privileged the true state too, is in `info`.
"""

import subprocess

import gymnasium
import msgpack
import numpy as np
from gymnasium import spaces
from websocket import create_connection


class SoftVTEnv(gymnasium.Env):
    """One episode after another on a connection of its own. Several environments may share a server."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(self, url="ws://127.0.0.1:8765", render_mode=None, camera=None):
        """`camera` is what `render` shows: a camera of the scene, its first if none, or "left" or "right" for a finger."""
        self.url, self.render_mode, self.camera = url, render_mode, camera
        self._server = None
        self._socket = create_connection(url)
        self.about = self._hear()
        self.observation_space = spaces.Dict(
            {key: _space(entry) for key, entry in self.about["observation_space"].items()}
        )
        self.action_space = _space(self.about["action_space"])
        self._next = {"task": 0, "episode": 0}

    @classmethod
    def launch(cls, script, *flags, softvt="softvt", **arguments):
        """Starts a server of its own, which ends with the environment. `flags` are words for `softvt serve`."""
        server = subprocess.Popen(
            [softvt, "serve", script, "--port", "0", *flags], stdout=subprocess.PIPE, text=True
        )
        url = server.stdout.readline().strip()
        if not url:
            raise RuntimeError(f"softvt serve ended with exit code {server.wait()}; it says why above")
        try:
            env = cls(url, **arguments)
        except BaseException:
            _end(server)
            raise
        env._server = server
        return env

    def reset(self, *, seed=None, options=None):
        """Begins an episode. `options` may name suite, task, episode and split, which stay until others are named.

        The seed is that of a whole run: with a new one comes episode 0, without one the next episode.
        """
        super().reset(seed=seed)
        wanted = dict(self._next)
        if seed is not None:
            wanted.update(seed=seed, episode=0)
        wanted.update(options or {})
        answer = self._ask("reset", **wanted)
        self._next = dict(wanted, episode=wanted["episode"] + 1)
        return answer["observation"], answer["info"]

    def step(self, action):
        """Carries out an action of shape (7), or several of shape (n, 7), the last of which is answered."""
        answer = self._ask("step", action=np.asarray(action, dtype=np.float64))
        ends = answer["terminated"], answer["truncated"]
        return answer["observation"], answer["reward"], *ends, answer["info"]

    def render(self):
        """What the camera sees, uint8 (height, width, 3)."""
        return self._ask("render", camera=self.camera)["image"] if self.render_mode else None

    def get_state(self):
        """Where the episode stands, as plain data: for `set_state`, here or with any other server of the same kind."""
        return self._ask("get_state")["state"]

    def set_state(self, state):
        """Goes back to where an episode stood, to the bit; the answer is that of `reset`."""
        answer = self._ask("set_state", state=state)
        return answer["observation"], answer["info"]

    def close(self):
        """Ends the connection, and the server if it is its own."""
        socket, self._socket = self._socket, None
        server, self._server = self._server, None
        if socket is not None:
            socket.close()
        if server is not None:
            _end(server)

    def _ask(self, kind, **fields):
        if self._socket is None:
            raise RuntimeError("the environment is closed")
        self._socket.send_binary(msgpack.packb({"type": kind, **fields}, default=_pack))
        return self._hear()

    def _hear(self):
        answer = msgpack.unpackb(self._socket.recv(), object_hook=_unpack)
        if answer["type"] == "error":
            raise RuntimeError(answer["error"])
        return answer


def _end(server):
    server.terminate()
    server.wait()
    server.stdout.close()


def _space(entry):
    """A space as the server describes it: text, or an array with bounds for all its numbers or for each."""
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
