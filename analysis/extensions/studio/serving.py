"""The studio's server on the loopback address of this machine."""

from __future__ import annotations

import asyncio
import logging
import secrets
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

import uvicorn

from .server import application
from .session import Session

ADDRESS = "127.0.0.1"

# Seconds for answers under way when the studio ends.
LAST_ANSWERS = 1


class _Server(uvicorn.Server):
    """A server that leaves signals to the command, and asks it several times a second whether one
    came: what an answer raises, KeyboardInterrupt too, uvicorn takes for a failure of that answer.
    """

    def __init__(self, config: uvicorn.Config, answer: Callable[[], None]) -> None:
        super().__init__(config)
        self._answer = answer

    async def on_tick(self, counter: int) -> bool:
        self._answer()
        return await super().on_tick(counter)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        with nullcontext():
            yield


def _is_error(record: logging.LogRecord) -> bool:
    error = record.exc_info[1] if record.exc_info else None
    return not isinstance(error, asyncio.CancelledError | KeyboardInterrupt)


def serve(
    session: Session, port: int, tell: Callable[[str], None], answer: Callable[[], None]
) -> None:
    """Serve a session until the command is interrupted; `tell` receives the address to open, and
    `answer` raises KeyboardInterrupt after a signal.

    Port 0 is any free one.

    :raises OSError: the port cannot be opened.
    """
    # Of a socket whose protocol is not named, asyncio does not know that it may send at once, and
    # every answer waits 40 ms for an acknowledgement.
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    with listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((ADDRESS, port))
        # Before the address is told, so that nobody who follows it at once is refused.
        listener.listen()
        number, token = listener.getsockname()[1], secrets.token_urlsafe(24)
        config = uvicorn.Config(
            application(session, token, number),
            log_level="warning",
            access_log=False,
            server_header=False,
            lifespan="off",
            timeout_graceful_shutdown=LAST_ANSWERS,
        )
        # An answer that the end of the studio interrupts is no error.
        logging.getLogger("uvicorn.error").addFilter(_is_error)
        tell(f"http://{ADDRESS}:{number}/?token={token}")
        try:
            _Server(config, answer).run(sockets=[listener])
        finally:
            session.close()
