"""Client and launcher of `softvt serve`, which serves episodes over a websocket. docs/serve.md describes the protocol.

with Server("suites/object_soft.lua", "--profile", "vision") as server, server.connect() as client:
    start = client.request("reset", task=0, episode=0)
    after = client.request("step", action=np.zeros(7))
"""

import atexit
import hashlib
import json
import multiprocessing
import os
import secrets
import signal
import subprocess
import tempfile
import threading
from collections.abc import Sequence
from typing import Any
from urllib.parse import urlsplit

import msgpack
import numpy as np
from websocket import WebSocketBadStatusException, WebSocketException, create_connection

from .binary import find_binary
from .sources import stamps

PROTOCOL = 1
"""Version of the protocol that this client speaks."""

SERVERS = "SOFTVT_SERVERS"
"""Environment variable by which worker processes find the servers of their parent."""

LINGER_S = 10.0
"""Time for which a shared server waits for another environment after its last one, s."""

# More connections than any vector environment has; a connection costs nothing until its first reset.
_MAX_CLIENTS = "1024"
_END_TIMEOUT_S = 30.0
_MAX_MESSAGE_CHARS = 2000


class ServerError(RuntimeError):
    """The server did not start, or refused a request; the message is its own."""


class ServerLostError(ConnectionError):
    """The server does not answer, or has ended."""


class Client:
    """A connection to a server, with an episode of its own."""

    hello: dict[str, Any]
    """The server's first message: suites, tasks, profile, spaces."""

    def __init__(self, url: str, token: str | None = None, server: "Server | None" = None):
        """Connects. `token` is that of a server with `--token`; `server` explains why a server that was started here has ended."""
        self.url = url
        self._server = server
        self._socket: Any = None
        self._awaits_response = True
        self._sender: threading.Thread | None = None
        self._process = os.getpid()
        header = {"Authorization": f"Bearer {token}"} if token else {}
        try:
            self._socket = create_connection(url, header=header)
        except WebSocketBadStatusException as error:
            reason = {401: "its token is missing or wrong", 503: "it has as many clients as it accepts"}.get(error.status_code, str(error))
            raise ServerError(f"the server at {url} refuses the connection: {reason}") from error
        except (OSError, WebSocketException, ValueError) as error:
            raise self._lost(error) from error
        self.hello = self.receive()
        if self.hello.get("protocol") != PROTOCOL:
            self.close()
            raise ServerError(
                f"the server at {url} speaks protocol {self.hello.get('protocol')} (softvt {self.hello.get('softvt')}), and this package "
                f"protocol {PROTOCOL}; install both from the same version of softvt"
            )

    def request(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Sends a request and returns the response, with arrays as `numpy.ndarray`."""
        self.send(kind, **fields)
        return self.receive()

    @property
    def is_interrupted(self) -> bool:
        """True if a request has no response: it was interrupted, for example by Ctrl-C, and the connection cannot be used any more."""
        return self._awaits_response

    def interruption(self) -> str:
        """Why the request before has no response, in words."""
        sender = self._sender
        if sender is not None and sender is not threading.current_thread() and sender.is_alive():
            return f"thread {sender.name} waits for the response to its request; a connection is for one thread: give each thread its own"
        return "the request before was interrupted"

    def send(self, kind: str, **fields: Any) -> None:
        """Sends a request without waiting. It has to be followed by a `receive` before the next one."""
        if self._socket is None:
            raise ServerError("the connection is closed")
        if os.getpid() != self._process:
            raise ServerError(
                f"{kind}: the connection belongs to process {self._process}, of which this one is a fork; make the environment in this process"
            )
        if self._awaits_response:
            raise ServerError(f"{kind}: {self.interruption()}; make a new connection")
        message = msgpack.packb({"type": kind, **fields}, default=_pack)
        self._awaits_response = True
        self._sender = threading.current_thread()
        try:
            self._socket.send_binary(message)
        except (OSError, WebSocketException) as error:
            raise self._lost(error) from error

    def receive(self) -> dict[str, Any]:
        """Waits for the response to the last request."""
        if self._socket is None:
            raise ServerError("the connection is closed")
        try:
            message = self._socket.recv()
        except (OSError, WebSocketException) as error:
            raise self._lost(error) from error
        if not message:
            raise self._lost("it closed the connection")
        self._awaits_response = False
        response: dict[str, Any] = msgpack.unpackb(message, object_hook=_unpack)
        if response["type"] == "error":
            raise ServerError(response["error"])
        return response

    def close(self) -> None:
        """Closes the connection. A second call has no effect."""
        socket, self._socket = self._socket, None
        # A fork leaves the connection to the process that made it.
        if socket is not None and os.getpid() == self._process:
            # Without waiting for the answer of a server that simulates.
            socket.shutdown()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _lost(self, reason: object) -> ServerLostError:
        self.close()
        if self._server is not None and (end := self._server.end_reason()) is not None:
            return ServerLostError(f"the softvt server at {self.url} {end}; close the environment and make a new one")
        port = urlsplit(self.url).port or 80
        return ServerLostError(
            f"no softvt server answers at {self.url} ({reason}); start one with `softvt serve FILE.lua --port {port}`, or let the environment "
            "start its own by leaving out the url"
        )


class Server:
    """A server that this process started. It ends with `close`, and when this process ends, however that happens."""

    url: str
    """Address for clients, such as `ws://127.0.0.1:40123`."""
    token: str
    """Token that clients have to send, so that other users of the machine cannot connect."""

    def __init__(self, script: str, *flags: str, port: int = 0, binary: str | None = None, profile: str | None = None):
        """Starts `softvt serve script flags…` and waits until it accepts connections.

        Port 0 is any free one. `profile` is the text of a profile in Lua, in place of the flag `--profile`. Raises ServerError with the message
        of the program if it does not start, for example because the port is in use.
        """
        self.token = secrets.token_urlsafe(16)
        self._messages = tempfile.TemporaryFile()
        with tempfile.TemporaryDirectory(prefix="softvt-") as folder:
            if profile is not None:
                path = os.path.join(folder, "profile.lua")
                with open(path, "w", encoding="utf-8") as file:
                    file.write(profile)
                flags = ("--profile", path, *flags)
            command = [
                binary or find_binary(),
                "serve",
                script,
                "--port",
                str(port),
                "--threads",
                _MAX_CLIENTS,
                "--until-stdin-closes",
                *flags,
            ]
            # The system closes the pipe however this process ends, and the server ends with the pipe. In a session of its own the server
            # does not receive the Ctrl-C of a terminal.
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._messages,
                env={**os.environ, "SOFTVT_TOKEN": self.token},
                start_new_session=True,
            )
            _running.add(self)
            try:
                assert self._process.stdout is not None
                self.url = self._process.stdout.readline().decode().strip()
                if not self.url:
                    self._process.wait()
                    raise ServerError(f"softvt serve {self.end_reason()}")
            except BaseException:
                self.close()
                raise

    @property
    def pid(self) -> int:
        """Number of the server's process."""
        return self._process.pid

    def connect(self) -> Client:
        """A new connection."""
        return Client(self.url, self.token, self)

    @property
    def is_running(self) -> bool:
        """False once its process has ended."""
        return self._process.poll() is None

    def end_reason(self) -> str | None:
        """How the server ended, with its last messages; None while it runs."""
        try:
            # A connection is lost a moment before its process has ended.
            code = self._process.wait(timeout=1.0)
        except subprocess.TimeoutExpired:
            return None
        how = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        if self._messages.closed:
            return how
        self._messages.seek(0)
        words = self._messages.read().decode(errors="replace").strip()[-_MAX_MESSAGE_CHARS:]
        return f"{how}: {words}" if words else how

    def close(self) -> None:
        """Ends the server. A second call has no effect."""
        _running.discard(self)
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        process.stdin.close()
        try:
            process.wait(timeout=_END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()
        self._messages.close()

    def forget(self) -> None:
        """Closes this process's ends of the pipes, without ending the server: for a process that was forked from the one that started it."""
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Lease:
    """The use of a server that environments with equal arguments share, also those of worker processes."""

    url: str
    """Address of the server."""

    def __init__(self, url: str, token: str, shared: "_SharedServer | None"):
        """`shared` is the server if this process started it, and None if a parent did."""
        self.url = url
        self._token = token
        self._shared = shared

    def connect(self) -> Client:
        """A new connection."""
        return Client(self.url, self._token, None if self._shared is None else self._shared.server)

    def release(self) -> None:
        """Ends the use. The server ends `LINGER_S` after its last one. A second call has no effect."""
        shared, self._shared = self._shared, None
        if shared is not None:
            shared.release()


def lease(
    script: str, flags: Sequence[str] = (), binary: str | None = None, profile: str | None = None, narrowing: Sequence[str] = ()
) -> Lease:
    """The use of a server of `softvt serve script flags…`: one of this process or its parent that runs already, or a new one.

    `narrowing` are flags by which a new one serves a part of the tasks. One that runs without them serves that part too. A server has read its
    files when it started, so that files that were changed since then need another one.
    """
    program = binary or find_binary()

    def key_of(flags: Sequence[str]) -> str:
        words = json.dumps([program, os.getcwd(), script, [*flags], profile, stamps(program, script, flags)])
        return hashlib.sha256(words.encode()).hexdigest()

    key = key_of(flags)
    with _lock:
        # Other programs than workers would lose a server that ends with its last environment in this process.
        announced = _announced() if multiprocessing.parent_process() is not None else {}
        if narrowing and key not in _servers and key not in announced:
            flags = (*flags, *narrowing)
            key = key_of(flags)
        shared = _servers.get(key)
        if shared is None and (address := announced.get(key)) is not None:
            url, token = address
            try:
                Client(url, token).close()
                return Lease(url, token, None)
            except ServerLostError:
                pass
        if shared is None or not shared.server.is_running:
            server = Server(script, *flags, binary=program, profile=profile)
            # A server that records a run prints its results when it ends.
            shared = _servers[key] = _SharedServer(key, server, lingers=not any(flag.split("=")[0] == "--out" for flag in flags))
            _announce(key, server)
        return shared.lease()


class _SharedServer:
    """A server with the number of its uses."""

    def __init__(self, key: str, server: Server, lingers: bool):
        self.server = server
        self._key = key
        self._uses = 0
        self._lingers = lingers
        self._process = os.getpid()
        self._timer: threading.Timer | None = None

    def lease(self) -> Lease:
        self._uses += 1
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        return Lease(self.server.url, self.server.token, self)

    def release(self) -> None:
        # A forked process has copies of its parent's environments, whose servers are not its own.
        if self._process != os.getpid():
            return
        with _lock:
            self._uses -= 1
            if self._uses == 0 and self._lingers:
                self._timer = threading.Timer(LINGER_S, self.end_if_unused)
                self._timer.daemon = True
                self._timer.start()
                return
        self.end_if_unused()

    def end_if_unused(self) -> None:
        with _lock:
            if self._uses > 0:
                return
            if _servers.get(self._key) is self:
                del _servers[self._key]
                _announce(self._key, None)
        self.server.close()


_lock = threading.RLock()
_servers: dict[str, _SharedServer] = {}
_running: set[Server] = set()


def _announced() -> dict[str, list[str]]:
    """Addresses and tokens of shared servers that this process or its parent started, by key."""
    known: dict[str, list[str]] = json.loads(os.environ.get(SERVERS, "{}"))
    return known


def _announce(key: str, server: Server | None) -> None:
    """Tells later worker processes the address of a server, or that it has ended."""
    known = _announced()
    known.pop(key, None)
    if server is not None:
        known[key] = [server.url, server.token]
    os.environ[SERVERS] = json.dumps(known)


@atexit.register
def _end_all() -> None:
    for server in [*_running]:
        server.close()


def _leave_to_parent() -> None:
    """In a forked process: lets go of the servers of its parent, which would otherwise outlive it."""
    global _lock
    _lock = threading.RLock()
    _servers.clear()
    for server in _running:
        server.forget()
    _running.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_parent)


def _pack(value: object) -> object:
    """Arrays and their numbers as openpi's protocol has them."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        data = {b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
        return {b"__ndarray__": True, **data}
    raise TypeError(f"a {type(value).__name__} cannot be sent")


def _unpack(entry: dict[Any, Any]) -> Any:
    if b"__ndarray__" not in entry:
        return entry
    return np.frombuffer(entry[b"data"], entry[b"dtype"]).reshape(entry[b"shape"]).copy()
