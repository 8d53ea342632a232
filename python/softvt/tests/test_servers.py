"""Servers: their start and their end, and what clients learn of both."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
import softvt
from softvt import serve
from softvt.sources import stamps
from suites_for_tests import FOLDER, short_suite


def is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    # A zombie has ended; its new parent need not have noticed yet.
    stat = Path(f"/proc/{process}/stat").read_text(encoding="utf-8")
    return stat.rsplit(")", 1)[1].split()[0] != "Z"


def send_url(pipe, suite: str) -> None:
    """Sends the address of a new environment's server."""
    env = softvt.SoftVTEnv(suite, obs="proprio")
    pipe.send(env._client.url)
    env.close()


class Servers(unittest.TestCase):
    def test_a_server_ends_with_its_environment_which_may_be_closed_twice(self):
        with mock.patch.object(serve, "LINGER_S", 0.0):
            env = softvt.SoftVTEnv(short_suite(), obs="proprio")
            pid = next(iter(serve._running)).pid
            env.close()
            env.close()
            self.assert_ends(pid)
            with self.assertRaisesRegex(softvt.ServerError, "closed"):
                env.step(np.zeros(7))

    def test_an_environment_that_nobody_holds_lets_go_of_its_server(self):
        with mock.patch.object(serve, "LINGER_S", 0.0):
            env = softvt.SoftVTEnv(short_suite(), obs="proprio")
            pid = next(iter(serve._running)).pid
            del env
            self.assert_ends(pid)

    def test_environments_with_equal_arguments_share_a_server(self):
        first, second = (softvt.SoftVTEnv(short_suite(), obs="proprio", task=task) for task in (0, 3))
        other = softvt.SoftVTEnv(short_suite(), obs="proprio", control="pose")
        try:
            self.assertEqual(first._client.url, second._client.url)
            self.assertNotEqual(first._client.url, other._client.url)
        finally:
            for env in (first, second, other):
                env.close()

    def test_a_changed_file_of_a_suite_needs_another_server(self):
        folder = FOLDER / "edited"
        (folder / "parts").mkdir(parents=True)
        suite, part = folder / "edited.lua", folder / "parts" / "budget.lua"
        part.write_text("return 12\n")
        suite.write_text(
            'local suite = require "suites.spatial_soft"\n'
            'for _, task in ipairs(suite.tasks) do task.budget_steps = require("parts.budget") end\nreturn suite\n'
        )

        def budget():
            env = softvt.SoftVTEnv(str(suite), obs="proprio", cost=False)
            self.addCleanup(env.close)
            return env.hello["suites"][0]["tasks"][0]["budget_steps"], env._client.url

        first = budget()
        self.assertEqual(budget(), first, "the server is shared")
        part.write_text("return 13\n")
        second = budget()
        self.assertEqual((first[0], second[0]), (12, 13), "a required file has changed")
        suite.write_text(suite.read_text().replace('require("parts.budget")', "14"))
        self.assertEqual(budget()[0], 14, "the suite has changed")

    def test_files_that_a_server_reads_have_stamps(self):
        folder = FOLDER / "stamps"
        for name, text in {
            "mine.lua": 'require "lib.deep"; local mesh = "meshes/cup.obj"; require("assets." .. "cup")',
            "lib/deep.lua": "require('lib/deeper')",
            "lib/deeper.lua": "",
            "meshes/cup.obj": "",
            "assets/cup.lua": "",
            "profile.lua": "",
            "other.lua": "",
        }.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text)
        program = softvt.find_binary()
        found = stamps(program, str(folder / "mine.lua"), ("--profile", str(folder / "profile.lua"), "--set", "cameras.width=64"))
        paths = {Path(path) for path, *_ in found}
        expected = ("mine.lua", "lib/deep.lua", "lib/deeper.lua", "meshes/cup.obj", "assets/cup.lua", "profile.lua")
        self.assertEqual({path for path in paths if folder in path.parents}, {folder / name for name in expected})
        self.assertIn(Path(program), paths)

    def test_worker_processes_use_the_server_of_their_parent_and_other_programs_do_not(self):
        env = softvt.SoftVTEnv(short_suite(), obs="proprio")
        try:
            for method in ("fork", "spawn"):
                context = multiprocessing.get_context(method)
                reading, writing = context.Pipe(duplex=False)
                worker = context.Process(target=send_url, args=(writing, short_suite()))
                worker.start()
                self.assertEqual(reading.recv(), env._client.url, method)
                worker.join()
                self.assertEqual(worker.exitcode, 0)
            program = f"import softvt; print(softvt.SoftVTEnv({short_suite()!r}, obs='proprio')._client.url)"
            other = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
            self.assertNotEqual(other.stdout.strip(), env._client.url)
            env.reset(seed=0)
        finally:
            env.close()

    def test_a_server_ends_with_its_python_process(self):
        launch = f"""
import os, signal, softvt
from softvt import serve
env = softvt.SoftVTEnv({short_suite()!r}, obs="proprio", control="pose")
print(next(iter(serve._running)).pid, flush=True)
"""
        endings = {
            "at its last line": ("", 0),
            "by an exception": ("raise ValueError", 1),
            "by SIGTERM": ("os.kill(os.getpid(), signal.SIGTERM)", -signal.SIGTERM),
            "by SIGKILL": ("os.kill(os.getpid(), signal.SIGKILL)", -signal.SIGKILL),
            "after a fork that lives on": ("import time\nif os.fork() == 0: os.close(1); os.close(2); time.sleep(3); os._exit(0)", 0),
        }
        for how, (last, code) in endings.items():
            with self.subTest(how):
                ended = subprocess.run([sys.executable, "-c", launch + last], capture_output=True, text=True)
                self.assertEqual(ended.returncode, code, ended)
                self.assertNotIn("Exception ignored", ended.stderr)
                self.assert_ends(int(ended.stdout))

    def test_a_server_that_was_killed_is_named_with_the_signal(self):
        env = softvt.SoftVTEnv(short_suite(), obs="proprio", flags=("--seed", "5"))
        try:
            env.reset(seed=0)
            server = next(iter(server for server in serve._running if server.url == env._client.url))
            os.kill(server.pid, signal.SIGKILL)
            with self.assertRaisesRegex(softvt.ServerLostError, "ended by SIGKILL"):
                env.step(np.zeros(7))
            again = softvt.SoftVTEnv(short_suite(), obs="proprio", flags=("--seed", "5"))
            again.reset(seed=0)
            again.close()
        finally:
            env.close()

    def test_ctrl_c_does_not_reach_the_server(self):
        with softvt.Server(short_suite()) as server:
            self.assertNotEqual(os.getsid(server.pid), os.getsid(0))

    def test_a_port_in_use_is_refused_with_the_message_of_the_program(self):
        with softvt.Server(short_suite(), "--profile", "vision") as server:
            port = int(server.url.rsplit(":", 1)[1])
            with self.assertRaisesRegex(softvt.ServerError, f"exit code 2.*--port {port}: already in use"):
                softvt.Server(short_suite(), port=port)

    def test_an_error_of_a_script_is_that_of_the_program(self):
        broken = FOLDER / "broken.lua"
        broken.write_text("return softvt.suiet {}\n")
        with self.assertRaisesRegex(softvt.ServerError, 'broken.lua:1: .*did you mean "suite"'):
            softvt.SoftVTEnv(str(broken))
        with self.assertRaisesRegex(softvt.ServerError, "suites/object_sfot.lua"):
            softvt.SoftVTEnv("object_sfot")

    def test_a_server_accepts_clients_with_its_token_only(self):
        with softvt.Server(short_suite()) as server:
            with self.assertRaisesRegex(softvt.ServerError, "token is missing or wrong"):
                softvt.Client(server.url)
            softvt.Client(server.url, server.token).close()

    def test_a_missing_server_is_named_with_a_command(self):
        with self.assertRaisesRegex(softvt.ServerLostError, "ws://127.0.0.1:9 .*softvt serve FILE.lua --port 9"):
            softvt.SoftVTEnv(url="ws://127.0.0.1:9")

    def test_requests_of_several_clients_run_at_the_same_time(self):
        with softvt.Server(short_suite()) as server:
            clients = [server.connect() for _ in range(3)]
            for episode, client in enumerate(clients):
                client.send("reset", task=0, episode=episode)
            self.assertEqual([client.receive()["info"]["episode"] for client in clients], [0, 1, 2])
            for client in clients:
                client.close()

    def assert_ends(self, process: int):
        deadline = time.monotonic() + 60
        while is_running(process):
            self.assertLess(time.monotonic(), deadline, "the server runs on")
            time.sleep(0.02)


if __name__ == "__main__":
    unittest.main()
