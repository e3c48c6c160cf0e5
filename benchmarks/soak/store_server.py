"""An S3-compatible server, moto's, which can hold the n-th write into a folder until the writer is dead.

Run as ``python -m benchmarks.soak.store_server`` it prints its port and ends with its standard input, where it takes
``watch FOLDER NUMBER before|after`` (count anew, and hold the request of this number before or after it is carried
out), ``go FOLDER`` (let it pass; one held before is refused instead) and ``count FOLDER`` (print how many there were).
"""

from __future__ import annotations

import logging
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any
from urllib.request import Request, urlopen

BUCKET = "soak"
CREDENTIALS = {"AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_DEFAULT_REGION": "us-east-1"}
WRITES = ("PUT", "POST", "DELETE")


@dataclass
class Watched:
    """The write to hold."""

    number: int
    before: bool
    go: threading.Event = field(default_factory=threading.Event)


class Holding:
    """A WSGI application around another one that counts writes and holds some.

    Parameters
    ----------
    app
        The other one.
    tell
        Prints a line.
    """

    def __init__(self, app: Callable[..., Iterable[bytes]], tell: Callable[[str], None]):
        self._app, self._tell = app, tell
        self._lock = threading.Lock()
        self._writes: Counter[str] = Counter()
        self._watched: dict[str, Watched] = {}

    def __call__(self, environ: dict[str, Any], start_response: Callable[..., Any]) -> Iterable[bytes]:
        """Answer a request."""
        folder = environ["PATH_INFO"].removeprefix(f"/{BUCKET}/").partition("/")[0]
        watched = None
        if environ["REQUEST_METHOD"] in WRITES:
            with self._lock:
                self._writes[folder] += 1
                there = self._watched.get(folder)
                watched = there if there is not None and self._writes[folder] == there.number else None
        if watched is None:
            return self._app(environ, start_response)
        content = [b""] if watched.before else list(self._app(environ, start_response))
        self._tell(f"reached {folder}")
        watched.go.wait()
        if watched.before:
            start_response("503 Service Unavailable", [("Content-Length", "0")])
        return content

    def obey(self, line: str) -> None:
        """Do what a line of standard input says."""
        command, folder, *how = line.split()
        with self._lock:
            if command == "watch":
                self._writes[folder] = 0
                self._watched[folder] = Watched(int(how[0]), how[1] == "before")
            elif command == "go":
                self._watched.pop(folder).go.set()
            elif command == "count":
                self._tell(f"count {folder} {self._writes[folder]}")


def main() -> None:
    """Serve until standard input ends."""
    from moto.moto_server.werkzeug_app import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import make_server

    def tell(line: str) -> None:
        sys.stdout.write(f"{line}\n")  # in one piece, though several threads tell something
        sys.stdout.flush()

    logging.getLogger("werkzeug").setLevel(logging.CRITICAL)
    holding = Holding(DomainDispatcherApplication(create_backend_app), tell)
    server = make_server("127.0.0.1", 0, holding, threaded=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    port = server.server_address[1]
    with urlopen(Request(f"http://127.0.0.1:{port}/{BUCKET}", method="PUT")):
        pass
    tell(f"port {port}")
    for line in sys.stdin:
        holding.obey(line)


if __name__ == "__main__":
    main()
