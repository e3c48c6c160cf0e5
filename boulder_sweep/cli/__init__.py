"""The command ``sweep``: one module a command; parse, call, print."""
