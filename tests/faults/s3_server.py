"""An S3-compatible server on loopback, as a process of its own: moto's, with one bucket.

Run as ``python -m tests.faults.s3_server``; prints its port and ends with its standard input.
"""

from __future__ import annotations

import logging
import subprocess
import sys
from typing import Self

from s3fs import S3FileSystem

from tests.faults.processes import ROOT

BUCKET, SECRET = "sweeps", "no-one-may-read-this"


class S3Server:
    """A server, and the environment that leads there."""

    def __enter__(self) -> Self:
        S3FileSystem.clear_instance_cache()  # file systems of this process lead to an earlier server
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.s3_server"],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert self._process.stdout is not None
        self.environment = {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{int(self._process.stdout.readline())}",
            "AWS_ACCESS_KEY_ID": "test",
            "AWS_SECRET_ACCESS_KEY": SECRET,
            "AWS_DEFAULT_REGION": "us-east-1",
        }
        return self

    def send(self, number: int) -> None:
        """Send a signal to it, such as one that lets it hang."""
        self._process.send_signal(number)

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()


def main() -> None:
    """Serve until standard input ends."""
    import boto3
    from moto.server import ThreadedMotoServer

    logging.getLogger("werkzeug").setLevel(logging.CRITICAL)
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    _, port = server.get_host_and_port()
    boto3.client(
        "s3",
        endpoint_url=f"http://127.0.0.1:{port}",
        aws_access_key_id="test",
        aws_secret_access_key=SECRET,
        region_name="us-east-1",
    ).create_bucket(Bucket=BUCKET)
    print(port, flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    main()
