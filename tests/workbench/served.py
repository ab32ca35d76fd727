"""A real workbench on a real port for tests: the verb as a child process, asked over HTTP."""

import http.client
import json
import os
import re
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

PATIENCE_S = 120  # far beyond what a busy machine needs to end a server


class Served:
    """One running workbench."""

    def __init__(self, url: str, folder: Path, pid: int) -> None:
        self.url, self.folder, self.pid = url, folder, pid
        parts = urlsplit(url)
        self.port, self.token = parts.port, parts.path.strip("/")

    def hold_worker(self):
        """Stop the worker process where it is: what it does lasts until it is cancelled."""
        (worker,) = Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text().split()
        os.kill(int(worker), signal.SIGSTOP)

    def ask(self, method, path, body=None, headers=None, token=None):
        """(status, headers, body) of one request below the token."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        prefix = f"/{self.token if token is None else token}" if token != "" else ""
        connection.request(method, f"{prefix}/{path}", body, headers or {})
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, dict(answer.getheaders()), content

    def get(self, path):
        status, _, content = self.ask("GET", path)
        assert status == 200, content
        return json.loads(content)

    def order(self, kind, **fields):
        """Queue a job and wait for its end, by the event stream."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=300)
        connection.request("GET", f"/{self.token}/api/events")
        events = connection.getresponse()
        assert events.readline().startswith(b": connected")
        status, _, content = self.ask("POST", "api/jobs", json.dumps({"kind": kind, **fields}))
        assert status == 200, content
        job = json.loads(content)
        while job["state"] not in ("done", "failed", "cancelled"):
            line = events.readline()
            assert line, "the event stream ended"
            if line.startswith(b"data: ") and (said := json.loads(line[6:])).get("id") == job["id"]:
                job = said
        connection.close()
        return job


@contextmanager
def workbench(folder: Path):
    """Start `thrustd workbench FOLDER`, stop it at the end."""
    command = (sys.executable, "-m", "thrustd", "workbench", str(folder), "--no-browser")
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout and child.stderr
    noise: list[str] = []
    reader = threading.Thread(target=noise.extend, args=(child.stderr,), daemon=True)
    reader.start()
    try:
        url = re.search(r"http\S+", child.stdout.readline())
        assert url, "".join(noise)
        yield Served(url.group(), folder, child.pid)
    finally:
        child.terminate()
        child.wait(PATIENCE_S)
        reader.join(PATIENCE_S)
        child.stdout.close()
        child.stderr.close()
