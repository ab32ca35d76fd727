"""The page's server: files, windows of columns, jobs. Every answer comes from a file or from the worker's reports."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import msgspec
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from thrustd import __version__
from thrustd.core.errors import ThrustdError, UsageError
from thrustd.core.types import Status
from thrustd.records.marks import Mark, read_marks, write_marks
from thrustd.workbench.exporting import window_csv
from thrustd.workbench.folder import Folder, model_cards
from thrustd.workbench.follow import FollowedLog
from thrustd.workbench.foxglove import foxglove_layout
from thrustd.workbench.jobs import Job, JobBoard
from thrustd.workbench.lines import window
from thrustd.workbench.mapping import checked, keep_mapping, read_said, with_others
from thrustd.workbench.orders import order_of
from thrustd.workbench.session import after_job, change_session, read_session
from thrustd.workbench.uploads import receive
from thrustd.workbench.versions import undo

STATIC = Path(__file__).parent / "static"
MAX_BODY_BYTES = 1 << 20  # of anything but an upload
LOOK_EVERY_S = 1.0  # for files that came or went
MAX_LINES = 16
MAX_COLUMNS = 60  # of a CSV
DOWNLOADS = {
    ".csv": "text/csv",
    ".html": "text/html",
    ".png": "image/png",
    ".svg": "image/svg+xml",
}  # reports that are files


class Bench:
    """What the routes share."""

    def __init__(self, root: Path) -> None:
        self.folder = Folder(root)
        self.folder.state.mkdir(exist_ok=True)
        self.board = JobBoard(self.folder.root, self.folder.state)
        self.board.listen(self._after)
        self.followed: dict[str, FollowedLog] = {}

    def _after(self, job: Job) -> None:
        if job.state == "done":
            after_job(self.folder, job.kind, job.result)

    async def state(self, request: Request) -> Response:
        """Everything the overview shows; `stamp` is taken first: what changes meanwhile is asked for again."""
        folder = self.folder
        return _json({
            "stamp": folder.stamp(),
            "version": __version__,
            "folder": folder.root.name,
            "recordings": [self._recording(name) for name in folder.recordings()],
            "models": model_cards(folder),
            "session": read_session(folder),
            "jobs": self.board.jobs(),
            "status_words": {bit.value: bit.name for bit in Status},
        })  # fmt: skip

    def _recording(self, name: str) -> dict[str, Any]:
        path = self.folder.path(name)
        columns = self.folder.columns(name)
        card: dict[str, Any] = {"name": name, "bytes": path.stat().st_size, "meta": columns.meta if columns else None}
        card["growing"] = self.folder.growing(name)
        card["table"] = self._table(name)
        card["mapped"] = self.folder.mapping(name)
        runs = {model: self.folder.model_columns(name, model) for model in self.folder.models()}
        card["models"] = {model: [c.name for c in run.meta.channels] for model, run in runs.items() if run}
        try:
            card |= {"marks": read_marks(path), "key": self.folder.key(name), "reading": self.folder.reading(name)}
        except ThrustdError as problem:
            card |= {"marks": [], "key": "", "problem": str(problem)}
        return card

    def _table(self, name: str) -> dict[str, Any] | None:
        """What the card says of the file's own columns: its time, what it may have otherwise named, what nobody saw."""
        table = self.folder.table(name)
        if table is None:
            return None
        seen = read_said(self.folder.state).seen
        unseen = [theirs for theirs in table["offered"] if theirs not in seen] if seen else []
        return {"timed": table["timed"], "wanting": table["wanting"], "unseen": unseen}

    def _tables(self, name: str) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Of a file, and of the others of the folder; UsageError while it was not read."""
        tables = {one: found for one in self.folder.recordings() if (found := self.folder.table(one))}
        if name not in tables:
            raise UsageError(f"{name}: not read yet")
        return tables.pop(name), tables

    async def table(self, request: Request) -> Response:
        """The columns of a file as it calls them, with what they may be, and those of the folder's other files."""
        name = request.path_params["name"]
        return _json(with_others(name, *self._tables(name), read_said(self.folder.state)))

    async def set_mapping(self, request: Request) -> Response:
        """What columns are, in every file of the folder or with `?only=1` in this one; those files are read anew."""
        name, only = request.path_params["name"], "only" in request.query_params
        table, others = self._tables(name)
        own = table["columns"].keys()
        elsewhere = {column for other in others.values() for column in other["columns"]} if not only else set()
        mapping = checked(await _body(request), own, elsewhere)
        keep_mapping(self.folder.state, name, mapping, {*own, *elsewhere}, only=only)
        for one in self.folder.recordings():
            if self.folder.columns(one) is None:
                self.board.add("prepare", f"read {one}", {"recording": one})
        return _json(self.folder.mapping(name))

    async def lines(self, request: Request) -> Response:
        """A window of channels: recording, channel (repeated), from, to, buckets."""
        query = request.query_params
        name = query.get("recording", "")
        wanted = query.getlist("channel")[:MAX_LINES]
        lines = [self.folder.line(name, channel) for channel in wanted]
        if not lines:
            raise UsageError("lines: no channel asked for")
        meta = lines[0].columns.meta
        start_s, stop_s = _number(query, "from", meta.start_s), _number(query, "to", meta.stop_s)
        content = window(lines, start_s, stop_s, int(_number(query, "buckets", 1000)))
        return Response(content, media_type="application/octet-stream")

    async def window_csv(self, request: Request) -> Response:
        query = request.query_params
        name = query.get("recording", "")
        lines = [self.folder.line(name, channel) for channel in query.getlist("channel")[:MAX_COLUMNS]]
        if not lines:
            raise UsageError("window.csv: no channel asked for")
        meta = lines[0].columns.meta
        rows = window_csv(lines, _number(query, "from", meta.start_s), _number(query, "to", meta.stop_s))
        headers = {"content-disposition": 'attachment; filename="window.csv"'}
        return StreamingResponse(rows, media_type="text/csv; charset=utf-8", headers=headers)

    async def add_job(self, request: Request) -> Response:
        kind, title, arguments = order_of(self.folder, await _body(request))
        return _json(self.board.add(kind, title, arguments))

    async def cancel_job(self, request: Request) -> Response:
        return _json(self.board.cancel(request.path_params["job"]))

    async def report(self, request: Request) -> Response:
        """A report the worker wrote, by its number."""
        number = request.path_params["number"]
        path = self.folder.state / "reports" / f"{number}"
        if not number.replace("-", "").replace(".", "").isalnum() or number.startswith(".") or not path.is_file():
            raise UsageError(f"report {number!r}: there is none")
        if path.suffix in DOWNLOADS:
            headers = {"content-disposition": f'attachment; filename="thrustd-{number}"'}
            return FileResponse(path, media_type=DOWNLOADS[path.suffix], headers=headers)
        return Response(path.read_bytes(), media_type="application/json")

    async def set_session(self, request: Request) -> Response:
        return _json(change_session(self.folder, await _body(request)))

    async def set_marks(self, request: Request) -> Response:
        path = self.folder.path(request.path_params["name"])
        try:
            marks = msgspec.json.decode(await _body(request), type=tuple[Mark, ...])
        except (msgspec.DecodeError, RecursionError) as problem:
            raise UsageError(f"marks: {problem}") from None
        write_marks(path, marks)
        return _json(marks)

    async def upload(self, request: Request) -> Response:
        name = request.path_params["name"]
        incoming = await receive(self.folder, name, request)
        return _json(self.board.add("adopt", f"check {name}", {"incoming": incoming, "name": name}))

    async def undo(self, request: Request) -> Response:
        return _json(undo(self.folder, (await _body(request)).decode(errors="replace")))

    async def download(self, request: Request) -> Response:
        path = self.folder.path(request.path_params["name"])
        return FileResponse(path, filename=path.name)

    async def foxglove(self, request: Request) -> Response:
        """A layout for Foxglove that draws this flight log."""
        name = request.query_params.get("log", "")
        columns = self.folder.columns(name)
        if columns is None:
            raise UsageError(f"{name}: not read yet")
        channels = [channel.name for channel in columns.meta.channels]
        engines, mounts = (
            [channel.removeprefix(begin) for channel in channels if channel.startswith(begin)]
            for begin in ("estimate_thrust_n_", "mount_force_n_")
        )
        return _json(foxglove_layout(engines, mounts))

    async def live(self, request: Request) -> Response:
        """What was added to a growing flight log since the last question; `after` counts rows."""
        name = request.query_params.get("log", "")
        if name not in self.followed:
            self.followed[name] = FollowedLog(self.folder.path(name))
        log = self.followed[name]
        await asyncio.get_running_loop().run_in_executor(None, log.read_on)
        return _json(log.answer(int(_number(request.query_params, "after", 0))))

    async def events(self, request: Request) -> Response:
        return StreamingResponse(self._events(), media_type="text/event-stream")

    async def _events(self) -> AsyncIterator[bytes]:
        queue: asyncio.Queue[Job] = asyncio.Queue()
        stop = self.board.listen(queue.put_nowait)
        try:
            yield b": connected\n\n"
            while True:
                try:
                    job = await asyncio.wait_for(queue.get(), LOOK_EVERY_S)
                    yield b"event: job\ndata: " + msgspec.json.encode(job) + b"\n\n"
                except TimeoutError:
                    yield b"event: folder\ndata: " + msgspec.json.encode({"stamp": self.folder.stamp()}) + b"\n\n"
        finally:
            stop()

    def routes(self) -> list[Route | Mount]:
        return [
            Route("/", _page),
            Route("/api/state", self.state),
            Route("/api/lines", self.lines),
            Route("/api/window.csv", self.window_csv),
            Route("/api/jobs", self.add_job, methods=["POST"]),
            Route("/api/jobs/{job}", self.cancel_job, methods=["DELETE"]),
            Route("/api/reports/{number}", self.report),
            Route("/api/session", self.set_session, methods=["POST"]),
            Route("/api/marks/{name:path}", self.set_marks, methods=["PUT"]),
            Route("/api/files/{name:path}", self.upload, methods=["PUT"]),
            Route("/api/files/{name:path}", self.download),
            Route("/api/columns/{name:path}", self.table),
            Route("/api/columns/{name:path}", self.set_mapping, methods=["PUT"]),
            Route("/api/undo", self.undo, methods=["POST"]),
            Route("/api/live", self.live),
            Route("/api/foxglove", self.foxglove),
            Route("/api/events", self.events),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]


def application(root: Path) -> Starlette:
    """The application without its guard, see `thrustd.workbench.serve`."""
    bench = Bench(root)

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        task = asyncio.create_task(bench.board.run())
        yield
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    return Starlette(routes=bench.routes(), lifespan=lifespan, exception_handlers={ThrustdError: _problem})


async def _page(request: Request) -> Response:
    return FileResponse(STATIC / "index.html")


async def _problem(request: Request, problem: Exception) -> Response:
    return _json({"error": " ".join(str(problem).split())}, 400)


def _json(value: Any, status: int = 200) -> Response:
    return Response(msgspec.json.encode(value), status, media_type="application/json")


async def _body(request: Request) -> bytes:
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > MAX_BODY_BYTES:
            raise UsageError(f"request: more than {MAX_BODY_BYTES} bytes")
    return body


def _number(query: Any, name: str, default: float) -> float:
    text = query.get(name)
    try:
        value = default if text is None else float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e15:
        raise UsageError(f"{name} = {text!r}: expected a number")
    return value
