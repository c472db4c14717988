"""What is not saved when a studio ends, however it ends."""

import base64
import json
import signal
import sys
from pathlib import Path

import pytest
from ballplate.designs import shipped
from ballplate.extensions.studio.document import opened
from ballplate.extensions.studio.jobs import JOBS
from ballplate.extensions.studio.recovery import kept_in, recovered
from ballplate.extensions.studio.session import RefusedError, Session
from ballplate.extensions.studio.studio_command import unsaved
from ballplate.extensions.studio.sweeping import swept
from ballplate.simulator.inputs.messages import ExperimentError

from tests.cli.cuts import ACTED, remains
from tests.extensions.studio import wording

MODEL = """import numpy as np
from ballplate.models import Parameter, Reported


class Axes:
    dimension = 3
    parameters = (Parameter("scale", "1", "scale", "common scale", 1.0),)

    def jacobian(self, x, a, p):
        return x[:, :, None] + 0.0

    def error(self, x, a, p):
        return self.jacobian(x, a, p) @ a + p

    def reported(self):
        return Reported(("scale",), ("1",), np.eye(1))


def build(lower, upper):
    open({ran!r}, "w").close()
    return Axes()
"""
SETTINGS = "{kind: python, object: 'model:build'}"


def test_what_was_not_saved_is_there_again_with_the_file_a_step_back(design):
    session = Session(design)
    assert not kept_in(design).exists()
    session.act({"do": "turn", "position": "z low"})
    text = session.state()["text"]
    assert unsaved(session) == (wording.CHANGES_ARE_NOT_SAVED_AND_ARE_IN_PLATE)
    assert kept_in(design).stat().st_mode & 0o077 == 0
    # The first session is gone without another word.
    again = Session(design)
    state = again.state()
    assert state["text"] == text and not state["saved"] and "not saved" in state["note"]
    again.act({"do": "undo"})
    assert again.state()["text"] == design.read_text() and again.state()["note"] == ""
    assert not kept_in(design).exists()
    again.act({"do": "redo"})
    again.act({"do": "save"})
    assert unsaved(again) == wording.ALL_CHANGES_ARE_SAVED
    assert design.read_text() == text and not kept_in(design).exists()
    assert Session(design).state()["note"] == ""


def test_a_file_that_has_changed_since_is_not_overwritten_by_what_was_not_saved(design):
    Session(design).act({"do": "turn", "position": "z low"})
    written = design.read_bytes() + b"# another hand\n"
    design.write_bytes(written)
    again = Session(design)
    assert "changed since" in again.state()["note"]
    with pytest.raises(RefusedError, match=wording.HAS_CHANGED_ON_DISK):
        again.act({"do": "save"})
    assert design.read_bytes() == written
    again.act({"do": "undo"})
    assert again.state()["text"] == written.decode()


def test_a_new_file_is_not_written_before_it_is_saved_and_not_lost(tmp_path):
    design, beginning = tmp_path / "new.yaml", Path(shipped("quickstart.yaml")).read_text()
    session = Session(design, beginning=beginning)
    assert "is new" in session.state()["note"] and list(tmp_path.iterdir()) == []
    session.act({"do": "set", "path": ["title"], "value": "mine"})
    again = Session(design, beginning=beginning)
    assert again.state()["data"]["title"] == "mine" and not design.exists()


# What is done, and which text each file has then and its recovery takes up.
EDITS = [
    (None, {"plate.yaml": (0, 1)}),
    ({"do": "text", "text": 2}, {"plate.yaml": (0, 2)}),
    ({"do": "save"}, {"plate.yaml": (2, 2)}),
    ({"do": "text", "text": 3}, {"plate.yaml": (2, 3)}),
    ({"do": "undo"}, {"plate.yaml": (2, 2)}),
    ({"do": "redo"}, {"plate.yaml": (2, 3)}),
    ({"do": "save", "name": "copy.yaml"}, {"plate.yaml": (2, 2), "copy.yaml": (3, 3)}),
    ({"do": "text", "text": 4}, {"plate.yaml": (2, 2), "copy.yaml": (3, 4)}),
]


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.long)])
def test_a_studio_that_is_cut_anywhere_loses_nothing_that_it_has_taken(tmp_path, every):
    """From one that takes up what an earlier one has left; by SIGTERM and SIGKILL."""
    pytest.importorskip("starlette", reason="the studio is an extra")
    beginning = Path(shipped("quickstart.yaml")).read_text(encoding="utf-8")
    texts = [f"{beginning}# {k}\n" for k in range(5)]
    actions = [dict(one, text=texts[one.get("text", 0)]) for one, _ in EDITS if one]
    content = base64.b64encode(texts[0].encode()).decode()
    unsaved = json.dumps({"owner": "another", "content": content, "text": texts[1]})
    folder = tmp_path / "cut"
    _, *found = remains(
        lines={"studio": ["studio", str(folder / "plate.yaml"), "--no-browser"]},
        before={"studio": {"plate.yaml": texts[0], ".plate.yaml.unsaved": unsaved}},
        actions=actions,
        folder=str(folder),
        signals=[signal.SIGKILL, signal.SIGTERM],
        every=every,
        slow=False,
    )
    for left in found:
        assert left["status"] in (-signal.SIGKILL, 128 + signal.SIGTERM)
        acted = left["met"].count(ACTED)
        near = [states for _, states in EDITS[acted : acted + 2]]
        for name in ("plate.yaml", "copy.yaml"):
            given = laid_out(tmp_path / f"{left['number']}-{left['cut']}", left["there"], name)
            known = [[texts[k] for k in one[name]] if name in one else [None] * 2 for one in near]
            for text, expected in zip(given, zip(*known, strict=True), strict=True):
                assert text in expected, (name, left["number"], left["cut"], left["met"])
    assert len({left["met"].count(ACTED) for left in found}) >= len(EDITS) - 1


def laid_out(folder: Path, there: dict[str, str], name: str) -> tuple[str | None, str | None]:
    """The text of a file, and the one that is taken up, in a copy of what is there."""
    folder.mkdir(exist_ok=True)
    for one, content in there.items():
        (folder / one).write_bytes(content.encode("latin-1"))
    if name not in there:
        return None, None
    document = opened(folder / name)
    return document.text, recovered(document, "next")[0].text


def test_changes_that_are_left_on_purpose_are_gone(design):
    other = design.with_name("other.yaml")
    other.write_bytes(design.read_bytes())
    for name in ("other.yaml", "plate.yaml"):
        session = Session(design)
        session.act({"do": "turn", "position": "z low"})
        session.act({"do": "open", "name": name, "discard": True})
        assert session.state()["saved"] and not kept_in(design).exists()


@pytest.mark.parametrize(
    "content", ["{", '{"text": 1}', '{"text": "x", "content": "?"}', "[" * 100_000, "\xff"]
)
def test_what_cannot_be_read_is_told_and_never_written_over(design, content):
    kept_in(design).write_text(content, encoding="latin-1")
    session = Session(design)
    state = session.state()
    assert "cannot be read" in state["note"] and state["saved"]
    session.act({"do": "turn", "position": "z low"})
    session.act({"do": "undo"})
    (aside,) = set_aside(design)
    assert aside.name in state["note"] and aside.read_text(encoding="latin-1") == content
    # It is told until it is deleted.
    assert aside.name in Session(design).state()["note"]


def set_aside(design: Path) -> list[Path]:
    names = design.parent.iterdir()
    return [one for one in names if one.name.startswith(f"{kept_in(design).name}-")]


def test_two_studios_on_one_file_leave_each_other_what_is_not_saved(design):
    first, second = Session(design), Session(design)
    texts = []
    for session, name in ((first, "z low"), (second, "x low")):
        session.act({"do": "turn", "position": name})
        texts.append(session.state()["text"])
    assert texts[0] != texts[1]
    assert "the same command" in unsaved(first) and "another studio" in unsaved(second)
    (aside,) = set_aside(design)
    for path, text in zip((kept_in(design), aside), texts, strict=True):
        assert json.loads(path.read_text())["text"] == text
    # A third takes up what the first has kept, which goes on to keep its own.
    third = Session(design)
    assert third.state()["text"] == texts[0] and aside.name in third.state()["note"]
    third.act({"do": "undo"})
    assert not kept_in(design).exists()
    assert first.state()["recoverable"]
    assert json.loads(kept_in(design).read_text())["text"] == texts[0]
    second.act({"do": "undo"})
    assert set_aside(design) == [] and kept_in(design).exists()


def test_what_was_kept_before_the_folder_was_full_is_no_promise(design, monkeypatch):
    session = Session(design)
    session.act({"do": "turn", "position": "z low"})
    assert session.state()["recoverable"]

    def fail(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("ballplate.extensions.studio.recovery.write_files", fail)
    session.act({"do": "turn", "position": "x low"})
    assert kept_in(design).exists() and not session.state()["recoverable"]
    assert wording.COULD_NOT_BE_KEPT in unsaved(session)
    monkeypatch.undo()
    assert session.state()["recoverable"]


def test_a_folder_that_is_not_there_is_told(tmp_path):
    with pytest.raises(ExperimentError, match="no such folder"):
        Session(tmp_path / "nowhere" / "plate.yaml", beginning="title: x\n")


def in_python(text: str) -> str:
    start, end = text.index("error_model:"), text.index("# The machine that")
    return text[:start] + f"error_model: {SETTINGS}\n" + text[end:]


@pytest.fixture
def ran(design: Path, monkeypatch) -> Path:
    """What a model beside the design leaves when it is run."""
    # Otherwise modules of these names are those of an earlier test.
    monkeypatch.setattr(sys, "path", list(sys.path))
    for name in ("model", "own"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    found = design.with_name("ran")
    design.with_name("model.py").write_text(MODEL.format(ran=str(found)))
    return found


def test_a_model_in_python_runs_from_the_file_that_was_named_and_from_no_other(design, ran):
    named = design.with_name("named.yaml")
    named.write_text(in_python(design.read_text()))
    design.with_name("other.yaml").write_bytes(named.read_bytes())
    session = Session(design)
    session.act({"do": "open", "name": "other.yaml"})
    assert any("Python" in one["text"] for one in session.state()["messages"])
    session.act({"do": "set", "path": ["title"], "value": "mine"})
    session.act({"do": "undo"})
    session.act({"do": "reopen"})
    session.act({"do": "save", "name": "copy.yaml"})
    assert not ran.exists()
    # Whom the command has named may run it: the test above can fail.
    state = Session(named).state()
    assert ran.exists() and state["messages"] == []


def test_no_change_brings_a_model_in_python_into_a_file_that_was_not_named(design, ran):
    design.with_name("other.yaml").write_bytes(design.read_bytes())
    session = Session(design)
    session.act({"do": "open", "name": "other.yaml"})
    text = session.state()["text"]
    settings = {"kind": "python", "object": "model:build"}
    for action in (
        {"do": "text", "text": in_python(text)},
        {"do": "set", "path": ["error_model", "kind"], "value": "python"},
        {"do": "set", "path": ["true_machine"], "value": SETTINGS},
        {"do": "repair", "edits": [{"path": ["true_machine"], "value": settings, "is_new": False}]},
    ):
        session.act(action)
        assert session.state()["messages"]
        for name in ("suggest", "next", "monte carlo", "plan", "sweep", "fit"):
            with pytest.raises(ExperimentError):
                work = {"axes": [{"paths": ["title"], "values": ["x"]}], "name": "", "content": ""}
                JOBS[name](session._document, work, lambda step: None)
        for name in ("turn", "copy", "stand"):
            with pytest.raises(ExperimentError):
                session.view("preview", {"do": name, "position": "z low", "across": "x"})
        session.act({"do": "undo"})
        assert session.state()["messages"] == [] and not ran.exists()
    # A position that says so is no position: what else there is, is evaluated.
    session.act({"do": "add", "settings": settings})
    session.view("preview", {"do": "turn", "position": "z low"})
    state = session.state()
    assert state["messages"] and not state["stale"] and not ran.exists()


def test_no_sweep_brings_a_model_in_python_into_a_file_that_was_not_named(design, ran):
    design.with_name("other.yaml").write_bytes(design.read_bytes())
    session = Session(design)
    session.act({"do": "open", "name": "other.yaml"})
    for axes in (
        [{"paths": ["error_model"], "values": [SETTINGS]}],
        [
            {"paths": ["error_model.kind"], "values": ["kinematic", "python"]},
            {"paths": ["error_model.object"], "values": ["'model:build'"]},
        ],
    ):
        found = swept(session._document, {"axes": axes}, lambda step: None)
        assert all(cell["reason"] for cell in found["cells"])
        assert len(axes) > 1 or wording.IS_CODE_IN_PYTHON in found["cells"][0]["reason"]
    assert not ran.exists()


def by_variant(text: str) -> str:
    """A text whose variant makes a model in Python of another."""
    return in_python(text).replace("kind: python", "kind: kinematic") + (
        "\nvariants:\n  all in one:\n    error_model.kind: python\n"
    )


def twice(text: str) -> str:
    """A text that is no right YAML, although a tree can be made of it."""
    return in_python(text).replace("kind: python", '"kind": "p\\u0079thon"') + "title: again\n"


@pytest.mark.parametrize(
    "change", [in_python, by_variant, twice, lambda text: in_python(text) + "title: [\n"]
)
def test_what_was_not_saved_brings_no_model_in_python_into_a_file(design, ran, change):
    session = Session(design)
    session.act({"do": "set", "path": ["title"], "value": "mine"})
    said = json.loads(kept_in(design).read_text())
    text = change(said["text"])
    assert text != said["text"]
    kept_in(design).write_text(json.dumps(said | {"text": text}))
    state = Session(design).state()
    assert "not restored" in state["note"] and state["saved"]
    (aside,) = set_aside(design)
    assert json.loads(aside.read_text())["text"] == text and not ran.exists()


def test_what_was_not_saved_does_not_exchange_the_model_in_python_of_a_file(design, ran):
    text = in_python(design.read_text())
    design.with_name("own.py").write_text(MODEL.format(ran=str(design.with_name("own"))))
    design.write_text(text.replace("model:build", "own:build"))
    session = Session(design)
    session.act({"do": "set", "path": ["title"], "value": "mine"})
    session.state()
    assert design.with_name("own").exists()
    said = json.loads(kept_in(design).read_text())
    # The file's own model may go on.
    assert Session(design).state()["data"]["title"] == "mine"
    for variant in ("error_model.object: 'model:build'", f"true_machine: {SETTINGS}"):
        other = f"{said['text']}\nvariants:\n  v:\n    {variant}\n"
        kept_in(design).write_text(json.dumps(said | {"text": other}))
        assert "not restored" in Session(design).state()["note"] and not ran.exists()
