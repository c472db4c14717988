"""Designs that begin on the studio's first page: questions of `init`, drafts, files and the example."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.designs import shipped

pytest.importorskip("starlette", reason="the studio is an extra")

from ballplate.extensions.drafting.data_sheet import READERS
from ballplate.extensions.studio.server import application
from ballplate.extensions.studio.session import RefusedError, Session
from ballplate.extensions.studio.studio_command import named_file
from ballplate.simulator.inputs import UnusableError
from starlette.testclient import TestClient

from tests.extensions.drafting.sheets import SHEETS, options
from tests.extensions.studio import wording

PORT, TOKEN = 8125, "a-token-of-the-tests"
EXAMPLE = Path(shipped("quickstart.yaml")).read_text(encoding="utf-8")


@pytest.fixture
def started() -> Iterator[Callable[[Path], Session]]:
    """Starts sessions, which end with the test."""
    sessions: list[Session] = []

    def start(path: Path) -> Session:
        sessions.append(Session(path, beginning=EXAMPLE))
        return sessions[-1]

    yield start
    for session in sessions:
        session.close()


def client(session: Session) -> TestClient:
    found = TestClient(application(session, TOKEN, PORT), base_url=f"http://127.0.0.1:{PORT}")
    found.get(f"/?token={TOKEN}")
    return found


def names(folder: Path) -> set[str]:
    return {file.name for file in folder.iterdir()}


@pytest.mark.parametrize("sheet", SHEETS.values(), ids=SHEETS)
def test_the_same_answers_give_the_file_of_init(sheet, tmp_path, started, monkeypatch):
    """And nothing but the text kept for recovery is written before Save."""
    monkeypatch.chdir(tmp_path)
    stated = sheet | {"tips": "star", "hours": "6"}
    page = client(started(tmp_path / "new.yaml"))
    assert page.get("/api/state").json()["untouched"]
    assert [one["name"] for one in page.get("/api/questions").json()["questions"]] == [*READERS]
    draft = page.post("/api/draft", json=sheet | {"name": "new.yaml"}).json()
    assert draft["messages"] == {} and names(tmp_path) == set()
    action = {"do": "begin", "name": "new.yaml", "text": draft["text"]}
    state = page.post("/api/do", json=action).json()
    assert not state["saved"] and not state["untouched"] and state["design"]["rank"]
    assert names(tmp_path) == {".new.yaml.unsaved"}
    page.post("/api/do", json={"do": "save"})
    written = (tmp_path / "new.yaml").read_bytes()
    assert main(["init", "new.yaml", *options(stated), "--force", "--quiet"]) == 0
    assert (tmp_path / "new.yaml").read_bytes() == written and names(tmp_path) == {"new.yaml"}


def test_wrong_answers_are_reported_by_field(tmp_path, started):
    (tmp_path / "there.yaml").write_text("title: x\n")
    page = client(started(tmp_path / "new.yaml"))
    answers = {"volume": "900 mm", "hours": "0", "name": "there.yaml"}
    draft = page.post("/api/draft", json=answers).json()
    assert set(draft["messages"]) == {"volume", "hours", "name"} and "text" not in draft
    assert wording.IS_THERE_ALREADY in draft["messages"]["name"]
    for name in ("", "../x.yaml", "x.txt", ".x.yaml", 7, 98 * "é" + ".yaml"):
        found = page.post("/api/draft", json={"name": name}).json()
        assert wording.IS_NOT_THE_NAME in found["messages"]["name"] and found["text"]
    action = {"do": "begin", "name": "there.yaml", "text": "title: y\n"}
    assert wording.IS_THERE_ALREADY in page.post("/api/do", json=action).json()["error"]
    assert "text" in page.post("/api/do", json={"do": "begin", "name": "a.yaml"}).json()["error"]
    assert names(tmp_path) == {"there.yaml"}


def test_a_draft_under_another_name_is_not_lost(tmp_path, started):
    """It is among the files of the folder, and cannot be begun again before it is opened."""
    first = started(tmp_path / "design.yaml")
    first.act({"do": "begin", "name": "mine.yaml", "text": EXAMPLE + "# mine\n"})
    assert first.path.name == "mine.yaml" and names(tmp_path) == {".mine.yaml.unsaved"}
    first.act({"do": "undo"})
    assert first.state()["text"] == EXAMPLE and names(tmp_path) == set()
    first.act({"do": "redo"})
    # The first session is gone without another word.
    again = started(tmp_path / "design.yaml")
    state = again.state()
    assert state["untouched"] and state["files"] == ["mine.yaml"]
    with pytest.raises(RefusedError, match=wording.CHANGES_OF_ANOTHER):
        again.act({"do": "begin", "name": "mine.yaml", "text": EXAMPLE})
    again.act({"do": "open", "name": "mine.yaml"})
    assert again.state()["text"].endswith("# mine\n")
    assert wording.NOT_SAVED_IN_AN_EARLIER_SESSION in again.state()["note"]
    again.act({"do": "save"})
    assert names(tmp_path) == {"mine.yaml"}


def test_changes_are_left_for_a_new_design_on_request_alone(tmp_path, started):
    session = started(tmp_path / "design.yaml")
    session.act({"do": "set", "path": ["title"], "value": "mine"})
    action = {"do": "begin", "name": "new.yaml", "text": EXAMPLE + "# new\n"}
    with pytest.raises(RefusedError, match=wording.HAS_CHANGES):
        session.act(action)
    # Of the same file, they are a step back.
    session.act({"do": "begin", "name": "design.yaml", "text": EXAMPLE + "# again\n"})
    session.act({"do": "undo"})
    assert session.state()["data"]["title"] == "mine"
    session.act(action | {"discard": True})
    assert session.path.name == "new.yaml" and names(tmp_path) == {".new.yaml.unsaved"}


def test_without_the_extension_that_asks_the_example_begins(tmp_path, started, monkeypatch):
    def missing(name: str) -> None:
        raise UnusableError(f"{name}: the extension drafting is not installed")

    monkeypatch.setattr("ballplate.extensions.studio.server.service", missing)
    page = client(started(tmp_path / "new.yaml"))
    asked = page.get("/api/questions").json()
    assert asked["questions"] == [] and "extension drafting" in asked["missing"]
    state = page.get("/api/state").json()
    assert state["text"] == EXAMPLE and state["design"] and state["untouched"]


def test_no_file_is_a_new_one_of_the_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert named_file(Path()) == Path("design.yaml")
    assert named_file(tmp_path / "x.yaml") == tmp_path / "x.yaml"
    for name in ("design.yaml", "design-2.yaml"):
        (tmp_path / name).write_text("title: x\n")
    assert named_file(tmp_path) == tmp_path / "design-3.yaml"


def test_the_command_needs_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    opened: list[Path] = []

    def serve(session: Session, *_: object) -> None:
        opened.append(session.path)
        session.close()

    monkeypatch.setattr("ballplate.extensions.studio.serving.serve", serve)
    assert main(["studio", "--no-browser", "--quiet"]) == 0
    assert main(["studio", "x.yaml", "--no-browser", "--quiet"]) == 0
    assert opened == [Path("design.yaml"), Path("x.yaml")] and names(tmp_path) == set()
