"""The studio's pages and requests, for this machine and the person who started it alone.

A request needs the token that the command has printed, as a cookie that the first page sets, the
address that the command has bound, and no other origin.
"""

from __future__ import annotations

import hmac
import json
import logging
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any

from ballplate.presentation import as_data
from ballplate.simulator.inputs import ExperimentError, UnusableError, service
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from .actions import ActionError
from .jobs import in_words
from .judging import VIEWS
from .session import OutdatedError, RefusedError, Session

STATIC = Path(__file__).parent / "static"

# The largest request: a text, or readings.
MOST_BYTES = 50_000_000

# Nothing is loaded but what a policy adds, no other page frames ours, and no form is sent.
CLOSED = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
POLICY = (
    f"{CLOSED}; script-src 'self'; style-src 'self' 'unsafe-inline';"
    " img-src 'self' data: blob:; connect-src 'self'"
)
PAGE_POLICY = f"{CLOSED}; style-src 'unsafe-inline'; img-src data:; sandbox"

HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}

logger = logging.getLogger(__name__)


def application(session: Session, token: str, port: int) -> Starlette:
    """The application of a session that is served on the loopback address."""
    hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
    page = (STATIC / "index.html").read_text(encoding="utf-8")
    answers: dict[str, Callable[[dict[str, Any]], Any]] = {
        "state": lambda body: session.state(),
        "do": partial(_act, session),
        "schema": lambda body: _schema(),
        "questions": lambda body: _questions(),
        "draft": session.draft,
        "jobs": lambda body: session.jobs(),
        "start": partial(_start, session),
        "stop": partial(_stop, session),
        **{name: partial(session.view, name) for name in VIEWS},
    }
    app = Starlette(
        routes=[
            Route("/", _page(page, token, port)),
            *(
                Route(f"/api/{name}", _answering(work), methods=["GET", "POST"])
                for name, work in answers.items()
            ),
            Route("/pages/{number:int}", _made_page(session)),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]
    )
    app.add_middleware(Guard, token=token, hosts=hosts, cookie=_cookie(port))
    return app


class Guard:
    """Refuses requests that do not come from the user at this machine."""

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
        headers = request.headers
        if headers.get("host", "") not in self.hosts:
            return "this address is not the studio's; use the one that the command has printed\n"
        origin = headers.get("origin")
        if origin is not None and origin not in {f"http://{host}" for host in self.hosts}:
            return "another page may not use the studio\n"
        if headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
            return "another page may not use the studio\n"
        token = request.cookies.get(self.cookie, "")
        if request.url.path == "/" and "token" in request.query_params:
            token = request.query_params["token"]
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            return "open the address that the command has printed, with its token\n"
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
        return HTMLResponse(page, headers=HEADERS | {"Content-Security-Policy": POLICY})

    return show


def _made_page(session: Session) -> Callable[[Request], Awaitable[Response]]:
    """Return a page of a computation, without permission for scripts and requests."""

    async def show(request: Request) -> Response:
        try:
            text = await run_in_threadpool(session.page, request.path_params["number"])
        except RefusedError as error:
            return PlainTextResponse(f"{error}\n", 404)
        return HTMLResponse(text, headers=HEADERS | {"Content-Security-Policy": PAGE_POLICY})

    return show


def _answering(
    work: Callable[[dict[str, Any]], Any],
) -> Callable[[Request], Awaitable[Response]]:
    """A request that is answered with plain data, or with the `error` that a person has made: an
    answer like any other, which a browser does not count among its own failures.
    """

    async def respond(request: Request) -> Response:
        body = {}
        if request.method == "POST":
            if not request.headers.get("content-type", "").startswith("application/json"):
                return _error("send JSON", 415)
            content = await _content(request)
            if content is None:
                return _error(f"more than {MOST_BYTES // 10**6} MB; leave some of it out", 413)
            try:
                body = json.loads(content)
            except (ValueError, RecursionError):
                return _error("this is no JSON", 400)
            if not isinstance(body, dict):
                return _error("send an object", 400)
        try:
            return _json(await run_in_threadpool(work, body))
        except KeyError as error:
            return _error(f"the request needs {error}")
        except (ActionError, ExperimentError, RefusedError) as error:
            return _json({"error": in_words(error), "outdated": isinstance(error, OutdatedError)})
        except Exception as error:
            # Nothing has changed by it; whoever looks after the program finds it in the terminal.
            logger.exception("the studio failed to answer %s", request.url.path)
            reason = f"{type(error).__name__}: {error}"
            return _error(f"the studio failed; the design is unchanged: {reason}")

    return respond


async def _content(request: Request) -> bytes | None:
    """The body of a request, whether its length is stated or not; None where it is too large."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > MOST_BYTES:
            return None
        parts.append(part)
    return b"".join(parts)


def _json(data: Any, status: int = 200) -> Response:
    # A file may say .nan or .inf, of which JSON has none.
    return Response(json.dumps(as_data(data)), status, media_type="application/json")


def _error(text: str, status: int = 200) -> Response:
    return _json({"error": text}, status)


def _act(session: Session, body: dict[str, Any]) -> Any:
    session.act(body)
    return session.state()


def _start(session: Session, body: dict[str, Any]) -> Any:
    return {"id": session.start(str(body.get("job")), body.get("settings") or {})}


def _stop(session: Session, body: dict[str, Any]) -> Any:
    session.stop(int(body.get("id", 0)))
    return session.jobs()


def _questions() -> Any:
    """Return the questions of a data sheet, or none with the reason."""
    try:
        return {"questions": service("sheet_questions")(), "missing": ""}
    except UnusableError as error:
        return {"questions": [], "missing": str(error)}


def _schema() -> Any:
    from ballplate.simulator.experiment import schema

    return schema()
