"""Who gets an answer: only the page that was opened with this run's token, on this machine, from this origin.

The token is the first element of every path (`http://127.0.0.1:PORT/TOKEN/...`), so that nothing - page, script, data,
event stream - is served without it, and no cookie travels to another port. Host is checked against DNS rebinding,
Origin against other pages, and the answer forbids every foreign script, frame and connection.
"""

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

SECURITY_HEADERS = (
    (
        b"content-security-policy",
        b"default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self';"
        b" font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cache-control", b"no-store"),
)
SAFE = frozenset({"GET", "HEAD"})


class Guard:
    """ASGI middleware in front of everything."""

    def __init__(self, app: App, token: str, port: int) -> None:
        self._app, self._token = app, token
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        self._origins = {f"http://{host}" for host in self._hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            await send({"type": "websocket.close", "code": 1008})
            return
        refusal = self._refusal(scope)
        if refusal:
            await _refuse(send, refusal)
            return
        rest = scope["path"].split("/", 2)
        inner = dict(scope, path="/" + (rest[2] if len(rest) > 2 else ""))
        inner.pop("raw_path", None)
        await self._app(inner, receive, _with_headers(send))

    def _refusal(self, scope: Scope) -> str:
        headers = {name.lower(): value.decode("latin-1") for name, value in scope["headers"]}
        host, origin = headers.get(b"host", ""), headers.get(b"origin")
        if host not in self._hosts:
            return "This address is not the workbench's own. Open the address that thrustd workbench printed."
        if origin is not None and origin not in self._origins:
            return "Another page asked for this; the workbench answers only its own."
        if scope["method"] not in SAFE and headers.get(b"sec-fetch-site", "same-origin") != "same-origin":
            return "Another page asked for this; the workbench answers only its own."
        parts = scope["path"].split("/", 2)
        if len(parts) < 3 or not hmac.compare_digest(parts[1].encode(), self._token.encode()):
            return "The token is missing or of another run. Open the address that thrustd workbench printed."
        return ""


async def _refuse(send: Send, line: str) -> None:
    body = (line + "\n").encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": 403, "headers": [*headers, *SECURITY_HEADERS]})
    await send({"type": "http.response.body", "body": body})


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = {name for name, _ in message.get("headers", [])}
            added = [(name, value) for name, value in SECURITY_HEADERS if name not in own]
            message = dict(message, headers=[*message.get("headers", []), *added])
        await send(message)

    return sending
