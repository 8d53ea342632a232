"""Policies learned from softvt's demonstrations: record, train, serve, evaluate, study, page."""


class UserError(Exception):
    """An error in the user's input. Its message says what to do; no traceback is shown."""
