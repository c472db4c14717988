"""A change is kept before it is judged, and judging never keeps the studio from answering."""

import json
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from http.cookiejar import CookieJar
from pathlib import Path

import pytest

pytest.importorskip("starlette", reason="the studio is an extra")

from ballplate.extensions.studio.recovery import kept_in
from ballplate.extensions.studio.session import RefusedError

from tests.extensions.studio.test_recovery import MODEL, in_python

POINTS = "points: {random: 200, seed: 1}"
SLOW = "points: {random: 20000, seed: 1}"


def kept_text(design: Path) -> str:
    return json.loads(kept_in(design).read_text())["text"]


def test_a_slow_design_is_kept_and_answered_as_pending(session, design, monkeypatch):
    first = session.state()
    assert POINTS in first["text"] and not first["pending"]
    monkeypatch.setattr("ballplate.extensions.studio.session.PATIENCE", 0.0)
    slow = first["text"].replace(POINTS, SLOW)
    session.act({"do": "text", "text": slow})
    assert kept_text(design) == slow
    state = session.state()
    assert state["pending"] and state["text"] == slow and state["messages"] == []
    # Figures of the earlier text are shown, and its data are those of the present one.
    assert state["design"] == first["design"]
    assert state["data"]["evaluation"]["points"]["random"] == 20000
    with pytest.raises(RefusedError, match="wait for them"):
        session.act({"do": "keep"})
    # Sessions of other tests may still have theirs.
    process = session._judge._process
    assert process in multiprocessing.active_children()
    # A further change stops what is under way.
    session.act({"do": "set", "path": ["title"], "value": "mine"})
    assert not process.is_alive() and kept_text(design) == session.state()["text"]
    session.act({"do": "undo"})
    monkeypatch.setattr("ballplate.extensions.studio.session.PATIENCE", 120.0)
    session.act({"do": "undo"})
    last = session.state()
    assert not last["pending"] and last["text"] == first["text"]
    assert last["design"]["quantities"] == first["design"]["quantities"]


def test_figures_are_never_those_of_another_text(session, monkeypatch):
    """Changes come at every stage of the judging of those before them."""
    monkeypatch.setattr("ballplate.extensions.studio.session.PATIENCE", 0.0)
    for k in range(7):
        session.act({"do": "set", "path": ["title"], "value": f"t{k}"})
        time.sleep(0.04 * k)
        state = session.state()
        assert state["data"]["title"] == f"t{k}"
        assert state["pending"] or state["design"]["title"] == f"t{k}"
    monkeypatch.setattr("ballplate.extensions.studio.session.PATIENCE", 120.0)
    assert session.state()["design"]["title"] == "t6"


FAILURES = {
    "raises": "raise MemoryError('no room')",
    "is killed": "import os, signal; os.kill(os.getpid(), signal.SIGKILL)",
}


@pytest.mark.parametrize("failure", FAILURES)
def test_what_fails_while_it_is_judged_is_kept_and_told(session, design, failure):
    before = session.state()
    text = in_python(before["text"])
    body = f"    if __import__('multiprocessing').parent_process(): {FAILURES[failure]}\n    open("
    model = MODEL.format(ran=str(design.with_name("ran"))).replace("    open(", body, 1)
    design.with_name("model.py").write_text(model)
    session.act({"do": "text", "text": text})
    assert kept_text(design) == text
    state = session.state()
    assert state["text"] == text and not state["pending"]
    assert state["messages"] and state["design"] == before["design"]
    session.act({"do": "undo"})
    state = session.state()
    assert not state["messages"] and state["text"] == before["text"]


def test_a_preview_that_is_overtaken_is_refused_and_ends(session):
    text = session.state()["text"]
    slow = {"do": "text", "text": text.replace(POINTS, SLOW)}
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(session.view, "preview", slow)
        while not session._workers["preview"].asked:
            time.sleep(0.01)
        found = session.view("preview", {"do": "set", "path": ["title"], "value": "mine"})
        with pytest.raises(RefusedError, match="later request"):
            first.result(60)
    assert found["title"] == "mine"


def test_other_requests_are_answered_while_quantities_are_kept(session, monkeypatch):
    found = []

    def is_free() -> bool:
        is_acquired = session._lock.acquire(timeout=5)
        if is_acquired:
            session._lock.release()
        return is_acquired

    def view(name, arguments):
        with ThreadPoolExecutor(1) as pool:
            found.append(pool.submit(is_free).result())
        return {"quantities": []}

    monkeypatch.setattr(session, "view", view)
    session.act({"do": "keep"})
    assert found == [True] and session.state()["kept"] == {"quantities": []}


def begun(*words: str) -> tuple[subprocess.Popen, str, urllib.request.OpenerDirector]:
    """A studio in a process of its own, its address, and who may ask it."""
    process = subprocess.Popen(
        [sys.executable, *words, "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A shell starts what runs in the background with this signal ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
    opener.open(address).read()
    return process, address.partition("?")[0], opener


def below(process: int) -> set[int]:
    """The processes that a process has begun, and those that these have."""
    found = set()
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            words = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(words[1]) == process and words[0] != "Z":
            found |= {int(path.parent.name)} | below(int(path.parent.name))
    return found


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks processes up in /proc")
def test_the_command_answers_and_ends_while_it_judges(design):
    process, home, opener = begun("-m", "ballplate", "studio", str(design))
    try:

        def ask(path: str, body: object = None) -> dict:
            content = None if body is None else json.dumps(body).encode()
            headers = {"Content-Type": "application/json"}
            with opener.open(urllib.request.Request(home + path, content, headers)) as answer:
                return json.loads(answer.read())

        text = ask("api/state")["text"].replace(POINTS, SLOW)
        state = ask("api/do", {"do": "text", "text": text})
        assert state["pending"] and state["text"] == text == kept_text(design)
        assert ask("api/state")["pending"] and ask("api/jobs") == []
        others = below(process.pid)
        assert others
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "Traceback" not in err and "Error" not in err, err
        assert re.search(r"; changes are not saved, and are in \.plate\.yaml\.unsaved: ", err)
        end = time.monotonic() + 30
        while any(Path(f"/proc/{one}").exists() for one in others):
            assert time.monotonic() < end, "a process is left"
            time.sleep(0.05)
    finally:
        process.kill()
        process.communicate()
