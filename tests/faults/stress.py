"""Disturb runs far away, again and again, and resume them: on a store that fails and on workers that die or hang.

``s3``: runs into an S3 server of which 10 to 30 % of the answers fail, are late or never come; each run is killed or
signalled up to three times. ``killed`` and ``stopped``: runs on a Dask cluster of which one worker is killed, or stops
without a word. After a resumed run, every table has to have the files of an undisturbed one, and nothing may be left.
Prints one JSON object. Run from the root of the repository as ``python -m tests.faults.stress KIND FOLDER RUNS SEED``.
"""

from __future__ import annotations

import http.client
import json
import os
import random
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from s3fs import S3FileSystem

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.runner.run import Progress, run
from tests.faults.clusters import Cluster
from tests.faults.faulty import slowly
from tests.faults.processes import Driver
from tests.faults.s3_server import BUCKET, S3Server
from tests.runner.grids import grid_of, plausible
from tests.store.folders import nothing_left, parts_of

ROWS = 100_000
LONGEST_LIFE_S = 6.0
"""Before a signal [s]."""
LATE_S = 2.0
WORKER_TTL = "10s"
"""After which Dask gives a silent worker up."""


class FailingProxy(ThreadingHTTPServer):
    """Passes requests on to a server, and lets a share of them fail."""

    daemon_threads = True

    def __init__(self, target: str, share: float, chance: random.Random):
        super().__init__(("127.0.0.1", 0), _Passing)
        self.target, self.share, self.chance = urlsplit(target).netloc, share, chance
        self.met = Counter[str]()
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def url(self) -> str:
        """Where it listens."""
        return f"http://127.0.0.1:{self.server_address[1]}"

    def fate(self) -> str:
        """Draw what comes of a request."""
        how = self.chance.choice(["500", "503", "reset", "late"]) if self.chance.random() < self.share else "passed"
        self.met[how] += 1
        return how

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: clients are killed."""


class _Passing(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: FailingProxy

    def handle_one_request(self) -> None:
        """Pass a request on, or let it fail."""
        self.raw_requestline = self.rfile.readline(65537)
        if not self.raw_requestline or not self.parse_request():
            self.close_connection = True
            return
        body = self._body()
        how = self.server.fate()
        if how == "reset":
            self.close_connection = True
            return
        if how in ("500", "503"):
            self._answer(int(how), {}, b"")
            return
        if how == "late":
            time.sleep(LATE_S)
        server = http.client.HTTPConnection(self.server.target)
        server.request(self.command, self.path, body, {**self.headers, "Content-Length": str(len(body))})
        answer = server.getresponse()
        self._answer(answer.status, dict(answer.getheaders()), answer.read())
        server.close()

    def _body(self) -> bytes:
        if self.headers.get("Expect", "").lower() == "100-continue":
            self.send_response_only(100)
            self.end_headers()
        return self.rfile.read(int(self.headers.get("Content-Length", 0)))

    def _answer(self, status: int, headers: dict[str, str], content: bytes) -> None:
        self.send_response_only(status)
        for name, value in headers.items():
            if name.lower() not in ("content-length", "connection", "transfer-encoding"):
                self.send_header(name, value)
        length = headers.get("Content-Length") if self.command == "HEAD" else None
        self.send_header("Content-Length", length or str(len(content)))
        self.end_headers()
        self.wfile.write(content)


def on_a_failing_store(runs: int, chance: random.Random, whole: dict[str, bytes]) -> tuple[Counter[str], list[str]]:
    """Disturb runs into a store that fails; return what happened, and what was wrong."""
    told, faults = Counter[str](), list[str]()
    with S3Server() as server:
        straight = server.environment["AWS_ENDPOINT_URL"]
        proxy = FailingProxy(straight, 0.0, chance)
        files = S3FileSystem(key="test", secret=server.environment["AWS_SECRET_ACCESS_KEY"], endpoint_url=straight)
        for number in range(runs):
            proxy.share = chance.uniform(0.1, 0.3)
            kinds = chance.choices([signal.SIGKILL, signal.SIGTERM, signal.SIGINT], k=chance.randint(1, 3))
            for kind in [*kinds, *3 * [None]]:
                code, last, complaints = _run(
                    f"s3://{BUCKET}/{number}",
                    {**server.environment, "AWS_ENDPOINT_URL": proxy.url},
                    kind,
                    chance.uniform(0.5, LONGEST_LIFE_S),
                )
                told[f"exit {code}"] += 1
                if complaints or (code not in (-9, -15, 3) and "--resume" not in last.get("problem", "--resume")):
                    faults.append(f"{number}: {code}, {last}, {complaints[-300:]}")
                if code == 3:
                    break
            files.invalidate_cache()
            if {Path(path).name: files.cat_file(path) for path in files.ls(f"{BUCKET}/{number}")} != whole:
                faults.append(f"{number}: other files")
        if uploads := files.call_s3("list_multipart_uploads", Bucket=BUCKET).get("Uploads", []):
            faults.append(f"{len(uploads)} unfinished uploads")
        return told + proxy.met, faults


def _run(out: str, environment: dict[str, str], kind: int | None, life: float) -> tuple[int, dict[str, Any], str]:
    """Resume a run that is killed or signalled after a while [s], unless it is done before."""
    driver = Driver(out, "--rows", str(ROWS), "--simulate", "slowly", "--resume", **environment)
    timer = threading.Timer(life, lambda: driver.signal(kind or 0))
    if kind is not None:
        timer.start()
    try:
        return driver.end()
    finally:
        timer.cancel()


def on_workers(
    kind: str, folder: Path, runs: int, chance: random.Random, whole: dict[str, bytes]
) -> tuple[Counter[str], list[str]]:
    """Disturb runs on a cluster of three workers; return what happened, and what was wrong."""
    told, faults = Counter[str](), list[str]()
    os.environ["DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL"] = WORKER_TTL
    for number in range(runs):
        out = folder / f"{kind}-{number}"
        with Cluster(3, folder) as cluster:
            disturb = _At(chance.uniform(0.0, 0.8) * ROWS, partial(_disturb, cluster, kind))
            try:
                run(grid_of(ROWS), out, backend="dask", scheduler=cluster.address, simulate=slowly, progress=disturb)
                told["ended by itself"] += 1
            except BoulderSweepError as problem:
                told["ended in words"] += 1
                if "--resume" not in str(problem):
                    faults.append(f"{number}: {problem}")
        if not disturb.done:
            faults.append(f"{number}: the run was done before")
        if not out.exists() or parts_of(out) != whole:
            run(grid_of(ROWS), out, resume=True, simulate=plausible)
        if parts_of(out) != whole or not nothing_left(out):
            faults.append(f"{number}: other files, or something is left")
    return told, faults


class _At:
    """Acts once, when so many rows are done."""

    def __init__(self, rows: float, act: Callable[[], None]):
        self._rows, self._act, self.done = max(rows, 1.0), act, False

    def __call__(self, progress: Progress) -> None:
        if progress.rows_done >= self._rows and not self.done:
            self.done = True
            self._act()


def _disturb(cluster: Cluster, kind: str) -> None:
    if kind == "killed":
        cluster.kill_worker()
    else:
        cluster.workers[0].send_signal(signal.SIGSTOP)


def main() -> None:
    """Disturb as many runs as asked for and print the outcome."""
    kind, folder, runs, seed = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    chance = random.Random(seed)
    run(grid_of(ROWS), folder / "whole", simulate=plausible)
    whole = parts_of(folder / "whole")
    if kind == "s3":
        told, faults = on_a_failing_store(runs, chance, whole)
    else:
        told, faults = on_workers(kind, folder, runs, chance, whole)
    print(json.dumps({"runs": runs, "told": told, "faults": faults}))


if __name__ == "__main__":
    main()
