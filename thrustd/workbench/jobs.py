"""Long work: one queue, one worker process, everything that matters in files.

Every job is `.thrustd/jobs/<id>.json`, rewritten as it moves from waiting to running to done, failed or cancelled, so a
page that is loaded again in the middle of a fit finds it where it is. The worker process stays warm between jobs; it is
killed to cancel one, and a new one starts with the next.
"""

import asyncio
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from thrustd.core.errors import UsageError
from thrustd.sinks.whole_file import write_whole

KEEP = 60  # finished jobs listed
LINE_BYTES = 1 << 20  # longest line of the worker


class Job(msgspec.Struct, frozen=True):
    id: str
    kind: str
    title: str
    arguments: dict[str, Any]
    state: str = "waiting"  # waiting, running, done, failed, cancelled
    fraction: float = 0.0  # done, 0 to 1
    note: str = ""  # what is going on
    error: str = ""  # one line
    result: dict[str, Any] = {}
    created_s: float = 0.0
    finished_s: float = 0.0

    @property
    def over(self) -> bool:
        return self.state in ("done", "failed", "cancelled")


class JobBoard:
    """Runs in the server's event loop; `listen` hears every change of a job."""

    def __init__(self, root: Path, state: Path) -> None:
        self._root, self._folder = root, state / "jobs"
        self._folder.mkdir(parents=True, exist_ok=True)
        self._jobs = {job.id: job for job in read_jobs(self._folder)}
        self._waiting: asyncio.Queue[str] = asyncio.Queue()
        self._worker: asyncio.subprocess.Process | None = None
        self._listeners: set[Callable[[Job], None]] = set()
        self._running = ""
        for job in list(self._jobs.values()):
            if not job.over:
                self._end(job.id, "failed", error="the workbench was closed before it was done")

    def jobs(self) -> list[Job]:
        """Latest first."""
        return sorted(self._jobs.values(), key=lambda job: job.created_s, reverse=True)[:KEEP]

    def job(self, job_id: str) -> Job:
        if job_id not in self._jobs:
            raise UsageError(f"{job_id!r}: no such job")
        return self._jobs[job_id]

    def add(self, kind: str, title: str, arguments: dict[str, Any]) -> Job:
        """Queue a job; the same work already waiting or running is not done twice."""
        for job in self._jobs.values():
            if not job.over and (job.kind, job.arguments) == (kind, arguments):
                return job
        now_s = time.time()
        job = Job(f"{int(now_s * 1000):013d}-{len(self._jobs) % 1000:03d}", kind, title, arguments, created_s=now_s)
        self._jobs[job.id] = job
        self._set(job.id)
        self._waiting.put_nowait(job.id)
        return job

    def cancel(self, job_id: str) -> Job:
        job = self.job(job_id)
        if not job.over:
            self._end(job_id, "cancelled")
            if job_id == self._running:
                self._kill()
        return self.job(job_id)

    def listen(self, listener: Callable[[Job], None]) -> Callable[[], None]:
        """Returns the function that ends it."""
        self._listeners.add(listener)
        return lambda: self._listeners.discard(listener)

    async def run(self) -> None:
        """Work through the queue until cancelled."""
        try:
            await self._warm()
            while True:
                job_id = await self._waiting.get()
                if not self.job(job_id).over:
                    self._running = job_id
                    await self._run_one(self.job(job_id))
                    self._running = ""
        finally:
            self._kill()

    async def _warm(self) -> asyncio.subprocess.Process:
        if self._worker is None or self._worker.returncode is not None:
            command = (sys.executable, "-m", "thrustd.workbench.worker", str(self._root))
            pipe = asyncio.subprocess.PIPE
            self._worker = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe, limit=LINE_BYTES)
        return self._worker

    async def _run_one(self, job: Job) -> None:
        self._set(job.id, state="running")
        worker = await self._warm()
        if self.job(job.id).over:  # cancelled while its worker was started: the worker never hears of it
            return
        assert worker.stdin is not None and worker.stdout is not None
        order = {"id": job.id, "kind": job.kind, "arguments": job.arguments}
        try:
            worker.stdin.write(msgspec.json.encode(order) + b"\n")
            while not self.job(job.id).over:
                line = await worker.stdout.readline()
                if not line:
                    break
                self._hear(job.id, msgspec.json.decode(line))
        except (OSError, ValueError) as problem:
            self._end(job.id, "failed", error=f"the worker process stopped: {problem}")
        if not self.job(job.id).over:
            self._end(job.id, "failed", error="the worker process stopped unexpectedly; see the terminal")
            self._kill()

    def _hear(self, job_id: str, said: dict[str, Any]) -> None:
        if self.job(job_id).over:  # cancelled: what it said on the way counts no more
            return
        if "progress" in said:
            self._set(job_id, fraction=said["progress"], note=said.get("note", ""))
        elif "done" in said:
            self._end(job_id, "done", fraction=1.0, result=said["done"])
        elif "failed" in said:
            self._end(job_id, "failed", error=said["failed"])

    def _end(self, job_id: str, state: str, **changes: Any) -> None:
        self._set(job_id, state=state, finished_s=time.time(), **changes)

    def _set(self, job_id: str, **changes: Any) -> None:
        job = self._jobs[job_id] = msgspec.structs.replace(self._jobs[job_id], **changes)
        write_whole(self._folder / f"{job_id}.json", msgspec.json.encode(job))
        for listener in tuple(self._listeners):
            listener(job)

    def _kill(self) -> None:
        """End the worker process at once; the next job starts another."""
        if self._worker is not None and self._worker.returncode is None:
            self._worker.kill()
        self._worker = None


def read_jobs(folder: Path) -> list[Job]:
    """The latest kept, the oldest first."""
    jobs = []
    for path in sorted(folder.glob("*.json"))[-KEEP:]:
        try:
            jobs.append(msgspec.json.decode(path.read_bytes(), type=Job))
        except (OSError, msgspec.DecodeError):
            continue  # a file of another version: the list is a convenience
    return jobs
