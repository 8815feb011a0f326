"""One module a command: what it takes (``arguments``) and what it does (``run``).

A command whose options are a table of settings names that table: ``SETTINGS``.
"""
