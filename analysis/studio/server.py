"""The studio's pages and requests, for this machine and the person who started it alone.

A request needs the token that the command has printed, as a cookie that the first page sets, the
address that the command has bound, and no other origin.
"""

from __future__ import annotations

import hmac
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from ballplate.simulator.inputs.messages import ExperimentError
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import (
    HTMLResponse,
    JSONResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
)
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from .actions import ActionError
from .session import RefusedError, Session

STATIC = Path(__file__).parent / "static"

# The largest request: a text, or readings.
MOST_BYTES = 50_000_000

POLICY = (
    "default-src 'none'; script-src 'self' 'nonce-{nonce}'; style-src 'self' 'unsafe-inline';"
    " img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none';"
    " frame-ancestors 'none'"
)


def application(session: Session, token: str, port: int) -> Starlette:
    """The application of a session that is served on the loopback address."""
    hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
    page = (STATIC / "index.html").read_text(encoding="utf-8")
    app = Starlette(
        routes=[
            Route("/", _page(page, token, port)),
            Route("/api/state", _answering(lambda request, body: session.state())),
            Route("/api/do", _answering(_acting(session)), methods=["POST"]),
            Route(
                "/api/preview",
                _answering(lambda request, body: session.preview(body)),
                methods=["POST"],
            ),
            Route(
                "/api/settings",
                _answering(lambda request, body: session.settings(str(body["position"]))),
                methods=["POST"],
            ),
            Route("/api/schema", _answering(lambda request, body: _schema())),
            Route("/api/jobs", _answering(lambda request, body: session.jobs())),
            Route("/api/start", _answering(_starting(session)), methods=["POST"]),
            Route("/api/stop", _answering(_stopping(session)), methods=["POST"]),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]
    )
    app.add_middleware(Guard, token=token, hosts=hosts, cookie=_cookie(port))
    return app


class Guard:
    """Refuses what the person at this machine has not asked for."""

    def __init__(self, app: ASGIApp, token: str, hosts: set[str], cookie: str) -> None:
        self.app, self.token, self.hosts, self.cookie = app, token, hosts, cookie

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self.app(scope, receive, send)
            return
        reason = self._reason(Request(scope))
        if reason is None:
            await self.app(scope, receive, send)
        else:
            await PlainTextResponse(reason, 403)(scope, receive, send)

    def _reason(self, request: Request) -> str | None:
        headers: Headers = request.headers
        if headers.get("host", "") not in self.hosts:
            return "this address is not the studio's; use the one that the command has printed\n"
        origin = headers.get("origin")
        if origin is not None and origin not in {f"http://{host}" for host in self.hosts}:
            return "another page may not use the studio\n"
        if headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
            return "another page may not use the studio\n"
        given = request.cookies.get(self.cookie, "")
        if request.url.path == "/" and "token" in request.query_params:
            given = request.query_params["token"]
        if not hmac.compare_digest(given.encode(), self.token.encode()):
            return "open the address that the command has printed, with its token\n"
        if int(headers.get("content-length") or 0) > MOST_BYTES:
            return f"more than {MOST_BYTES // 10**6} MB; leave some of it out\n"
        return None


def _cookie(port: int) -> str:
    # Cookies are shared by all ports of an address.
    return f"ballplate-studio-{port}"


def _page(page: str, token: str, port: int) -> Callable[[Request], Awaitable[Response]]:
    async def show(request: Request) -> Response:
        if "token" in request.query_params:
            away = RedirectResponse("/", 303)
            away.set_cookie(_cookie(port), token, httponly=True, samesite="strict", path="/")
            return away
        import secrets

        nonce = secrets.token_urlsafe(16)
        headers = {
            "Content-Security-Policy": POLICY.format(nonce=nonce),
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
        }
        return HTMLResponse(page.replace("{{nonce}}", nonce), headers=headers)

    return show


def _answering(
    work: Callable[[Request, dict[str, Any]], Any],
) -> Callable[[Request], Awaitable[Response]]:
    """A request that is answered with plain data, or with the `error` that a person has made: an
    answer like any other, which a browser does not count among its own failures.
    """

    async def respond(request: Request) -> Response:
        body: Any = {}
        if request.method == "POST":
            if not request.headers.get("content-type", "").startswith("application/json"):
                return JSONResponse({"error": "send JSON"}, 415)
            try:
                body = json.loads(await request.body())
            except ValueError:
                return JSONResponse({"error": "this is no JSON"}, 400)
            if not isinstance(body, dict):
                return JSONResponse({"error": "send an object"}, 400)
        try:
            found = await run_in_threadpool(work, request, body)
        except ExperimentError as error:
            text = "; ".join(
                f"{one.path}: {one.text}" if one.path else one.text for one in error.messages
            )
            return JSONResponse({"error": text})
        except (ActionError, KeyError, TypeError, ValueError) as error:
            return JSONResponse({"error": str(error)})
        except RefusedError as error:
            return JSONResponse({"error": str(error)})
        return JSONResponse(found)

    return respond


def _acting(session: Session) -> Callable[[Request, dict[str, Any]], Any]:
    def act(request: Request, body: dict[str, Any]) -> Any:
        session.act(body)
        return session.state()

    return act


def _starting(session: Session) -> Callable[[Request, dict[str, Any]], Any]:
    def start(request: Request, body: dict[str, Any]) -> Any:
        return {"id": session.start(str(body.get("job")), body.get("settings") or {})}

    return start


def _stopping(session: Session) -> Callable[[Request, dict[str, Any]], Any]:
    def stop(request: Request, body: dict[str, Any]) -> Any:
        session.stop(int(body.get("id", 0)))
        return session.jobs()

    return stop


def _schema() -> Any:
    from ballplate.simulator.experiment.schema import schema

    return schema()
