"""Policies learned from softvt's demonstrations: record, train, serve, evaluate, study, page."""

import os


class UserError(Exception):
    """An error in the user's input. Its message says what to do; no traceback is shown."""


def processors() -> int:
    """How many processors this process may use: taskset and job schedulers leave it fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
