"""What the studio answers, and whom it refuses."""

import base64
import json
import re
import time
from concurrent.futures import ThreadPoolExecutor

import ballplate as bp
import pytest
import yaml

pytest.importorskip("starlette", reason="the studio is an extra")

from ballplate.extensions.maps.length_map import length_map
from ballplate.extensions.studio.server import application
from ballplate.extensions.studio.session import RefusedError, Session
from ballplate.results.prediction import predict
from ballplate.simulator.experiment.loading import load
from starlette.testclient import TestClient

from tests.extensions.studio import wording

PORT, TOKEN = 8123, "a-token-of-the-tests"
HOME = f"http://127.0.0.1:{PORT}"


@pytest.fixture
def stranger(session):
    return TestClient(application(session, TOKEN, PORT), base_url=HOME, follow_redirects=False)


@pytest.fixture
def client(stranger):
    assert stranger.get(f"/?token={TOKEN}").status_code == 303
    return stranger


REQUESTS = [
    ("GET", "/"),
    ("GET", "/api/state"),
    ("GET", "/api/jobs"),
    ("GET", "/api/schema"),
    ("GET", "/api/questions"),
    ("POST", "/api/draft"),
    ("GET", "/api/later"),
    ("POST", "/api/matrix"),
    ("POST", "/api/drawn"),
    ("GET", "/pages/1"),
    ("GET", "/static/studio.js"),
    ("POST", "/api/do"),
    ("POST", "/api/start"),
]


def test_without_the_token_nothing_is_answered(stranger, session):
    before = session.state()["text"]
    for method, path in REQUESTS:
        for query in ("", "?token=", "?token=a-token-of-the-test"):
            body = {"do": "text", "text": "title: x"}
            answer = stranger.request(method, path + query, json=body)
            assert answer.status_code == 403 and "token" in answer.text, (method, path)
    assert session.state()["text"] == before


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://example.org"},
        {"Origin": "null"},
        {"Origin": f"https://127.0.0.1:{PORT}"},
        {"Origin": "http://127.0.0.1:9999"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"Host": "example.org"},
        {"Host": "127.0.0.1:9999"},
        {"Host": ""},
    ],
)
def test_another_origin_or_host_is_refused_with_the_token_too(client, headers):
    for method, path in REQUESTS:
        answer = client.request(method, path, json={"do": "undo"}, headers=headers)
        assert answer.status_code == 403, (method, path)


def test_the_page_may_ask_nobody_else(client):
    page = client.get("/")
    policy = page.headers["content-security-policy"]
    assert "default-src 'none'" in policy and "connect-src 'self'" in policy
    assert "http" not in page.text.replace("http-equiv", "")
    cookie = client.get(f"/?token={TOKEN}").headers["set-cookie"].lower()
    assert "httponly" in cookie and "samesite=strict" in cookie


def test_a_form_of_another_page_cannot_act(client, session):
    answer = client.post(
        "/api/do", content='{"do": "undo"}', headers={"Content-Type": "text/plain"}
    )
    assert answer.status_code == 415


@pytest.mark.parametrize(
    "name", ["../other.yaml", "/etc/passwd", "sub/other.yaml", "other.txt", "", "..", "link.yaml"]
)
def test_files_outside_the_folder_are_refused(client, design, tmp_path_factory, name):
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "other.yaml"
    elsewhere.write_bytes(design.read_bytes())
    design.with_name("link.yaml").symlink_to(elsewhere)
    for action in ({"do": "open", "name": name}, {"do": "save", "name": name}):
        answer = client.post("/api/do", json=action).json()
        assert wording.IS_NOT_THE_NAME in answer["error"]
    assert elsewhere.read_bytes() == design.read_bytes()


def test_figures_of_another_file_are_not_shown_under_a_name(client, design):
    design.with_name("broken.yaml").write_text("title: [\n")
    answer = client.post("/api/do", json={"do": "open", "name": "broken.yaml"}).json()
    assert answer["messages"] and answer["design"] is None


def test_a_text_that_no_file_can_hold_is_refused(client):
    body = '{"do": "text", "text": "title: \\ud800 x"}'
    headers = {"Content-Type": "application/json"}
    answer = client.post("/api/do", content=body, headers=headers).json()
    assert wording.IS_NO_CHARACTER in answer["error"]
    assert "error" not in client.get("/api/state").json()


def wait(client, seconds=120.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = client.get("/api/jobs").json()
        if all(one["state"] != "running" for one in found):
            return found
        time.sleep(0.05)
    raise AssertionError(found)


def test_figures_are_those_of_run(client, design):
    answer = client.post("/api/do", json={"do": "move", "position": "z low", "by": [0.05, 0, 0.1]})
    found = answer.json()["design"]
    client.post("/api/do", json={"do": "save"})
    (experiment,) = load(design)
    drawn = client.post("/api/drawn", json={"map": "lengths"}).json()
    expected = predict(experiment).quantities
    # No average of micrometres and microradians together is shown.
    mixed = {symbol for symbol, quantity in expected.items() if quantity.unit == "m, rad"}
    assert mixed == {"U2", "U3"}
    shown = [symbol for symbol in expected if symbol not in mixed]
    assert [row["symbol"] for row in drawn["quantities"]] == shown
    for row in (*found["quantities"], *drawn["quantities"]):
        quantity = expected[row["symbol"]]
        assert row["average"] == quantity.average and row["maximum"] == quantity.maximum
    lengths = expected["U6"]
    assert found["rank"]["deficiency"] == 0 and found["within"] == lengths.within_target
    # The worst length is the one that is named.
    for end, place in zip(("from", "to"), lengths.places, strict=True):
        shown = ", ".join(f"{round(1e3 * value, 1) + 0.0:.9g}" for value in found["worst"][end])
        assert f"({shown}) mm" in place
    later = client.get("/api/later").json()
    prediction = predict(experiment)
    assert later["fingerprint"] == answer.json()["fingerprint"]
    assert later["lines"] and all(line in prediction.lines() for line in later["lines"])
    assumptions = prediction.assumptions
    warning = "; ".join(text for _, text in assumptions.doubling)
    assert later["assumptions"]["warning"] == warning != ""
    assert later["assumptions"]["assumptions"] == assumptions.to_dict()["assumptions"]


def test_errors_by_positions_are_those_of_run(client, design):
    (experiment,) = load(design)
    settings = {**yaml.safe_load(design.read_text())["positions"][0], "name": "again"}
    settings["corner"] = {"x": "100 mm", "y": "200 mm"}
    found = client.post("/api/matrix", json={}).json()
    assert found.pop("fingerprint") == client.get("/api/state").json()["fingerprint"]
    assert found == bp.information(experiment).to_dict()
    with_candidate = client.post("/api/matrix", json={"settings": settings}).json()
    assert with_candidate["positions"][-1]["is_added"]
    assert with_candidate["positions"][-1]["average"] < found["average"]
    # A candidate that cannot be read is none.
    without = client.post("/api/matrix", json={"settings": settings | {"level": "2 m"}}).json()
    assert without["positions"] == found["positions"]


def test_a_change_in_another_window_is_not_lost(client):
    state = client.get("/api/state").json()
    turn = {"do": "turn", "position": "z low", "revision": state["revision"]}
    assert "error" not in client.post("/api/do", json=turn).json()
    refused = client.post("/api/do", json=turn).json()
    assert "another window" in refused["error"] and refused["outdated"]
    unknown = {**turn, "do": "nothing", "revision": state["revision"] + 1}
    assert client.post("/api/do", json=unknown).json()["outdated"] is False


def test_a_request_is_limited_though_its_length_is_not_stated(client, monkeypatch, session):
    monkeypatch.setattr("ballplate.extensions.studio.server.MOST_BYTES", 2000)
    headers = {"Content-Type": "application/json"}
    taken = []

    def parts():
        yield b'{"do": "text", "text": "'
        for _ in range(1000):
            taken.append(1)
            yield b"x" * 100
        yield b'"}'

    before = session.state()["text"]
    answer = client.post("/api/do", content=parts(), headers=headers)
    assert answer.status_code == 413 and wording.LEAVE_SOME_OF_IT_OUT in answer.json()["error"]
    long = client.post("/api/do", content=b'{"do": "' + b"x" * 3000 + b'"}', headers=headers)
    assert long.status_code == 413
    assert session.state()["text"] == before
    assert client.post("/api/do", json={"do": "undo"}).status_code == 200


@pytest.mark.parametrize("value", [".nan", '"\\ud800"', "2026-11-22", "!!binary aGk="])
def test_whatever_a_text_says_the_state_is_an_answer(client, value):
    text = client.get("/api/state").json()["text"]
    for old, new in (
        ("title: 5 x 5 ball plate in six positions", "title: "),
        ("repeatability: 0.2 um", "repeatability: "),
    ):
        assert old in text
        said = text.replace(old, new + value)
        answer = client.post("/api/do", json={"do": "text", "text": said})
        assert "error" not in answer.json() and answer.json()["text"] == said

        def refuse(constant):
            raise AssertionError(constant)

        # A browser knows no NaN and no Infinity.
        json.loads(client.get("/api/state").text, parse_constant=refuse)
        client.post("/api/do", json={"do": "undo"})


def test_a_position_that_is_off_stays_in_the_file_in_its_order_with_its_comment(client):
    before = client.get("/api/state").json()

    def enabled(state):
        return {one["name"]: one["enabled"] for one in state["design"]["scene"]["positions"]}

    state = client.post("/api/do", json={"do": "off", "position": "y low"}).json()
    assert list(enabled(state)) == list(enabled(before)) and not enabled(state)["y low"]
    assert state["text"].replace(", enabled: false", "") == before["text"]
    assert state["design"]["rank"]["observations"] < before["design"]["rank"]["observations"]
    state = client.post("/api/do", json={"do": "undo"}).json()
    assert state["text"] == before["text"]
    client.post("/api/do", json={"do": "redo"})
    state = client.post("/api/do", json={"do": "on", "position": "y low"}).json()
    assert state["text"] == before["text"] and all(enabled(state).values())
    refused = client.post("/api/do", json={"do": "on", "position": "y"}).json()["error"]
    assert 'no position "y"' in refused


def test_a_page_of_an_earlier_studio_changes_nothing(client, session, design):
    state = client.get("/api/state").json()
    other = Session(design)
    assert other.revision == state["revision"] and other.name != state["session"]
    turn = {"do": "turn", "position": "z low", "session": state["session"], "revision": 0}
    with pytest.raises(RefusedError, match="restarted"):
        other.act(turn)
    with pytest.raises(RefusedError, match="restarted"):
        other.view("preview", turn)
    session.act(turn)


def test_requests_in_parallel_lose_no_change(session):
    """Each of many actions at once is either made, or refused since another came first."""
    made = []

    def act(k):
        try:
            session.act({"do": "set", "path": ["title"], "value": f"t{k}"})
            made.append(f"t{k}")
        except RefusedError:
            pass

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(act, range(6)))
    state = session.state()
    assert sorted(made) == [f"t{k}" for k in range(6)]
    assert state["revision"] == state["back"] == 6
    titles = {state["data"]["title"]}
    for _ in range(5):
        session.act({"do": "undo"})
        titles.add(session.state()["data"]["title"])
    assert titles == set(made)


def test_the_session_goes_on_when_file_or_folder_are_gone(client, design):
    client.post("/api/do", json={"do": "turn", "position": "z low"})
    text = client.get("/api/state").json()["text"]
    design.unlink()
    assert "no such file" in client.post("/api/do", json={"do": "reopen"}).json()["error"]
    design.mkdir()
    error = client.post("/api/do", json={"do": "save"}).json()["error"]
    assert re.fullmatch(r"plate\.yaml cannot be written: [\w ]+", error)
    assert "folder" in client.post("/api/do", json={"do": "reopen"}).json()["error"]
    folder = design.parent
    folder.rename(folder.with_name("elsewhere"))
    assert "error" in client.post("/api/do", json={"do": "save", "name": "mine.yaml"}).json()
    answer = client.post("/api/do", json={"do": "turn", "position": "z low"}).json()
    assert "error" not in answer and answer["files"] == []
    folder.with_name("elsewhere").rename(folder)
    answer = client.post("/api/do", json={"do": "undo"}).json()
    assert answer["text"] == text


def test_a_computation_whose_process_is_killed_has_failed_and_may_be_of_an_earlier_design(
    client, session
):
    client.post("/api/start", json={"job": "monte carlo", "settings": {"trials": 500_000}})
    state = client.post("/api/do", json={"do": "turn", "position": "z low"}).json()
    session._jobs[1].worker._process.kill()
    (job,) = wait(client)
    assert job["state"] == "failed" and "without a result" in job["result"]
    assert job["fingerprint"] != state["fingerprint"]
    assert job["fingerprint"] == client.post("/api/do", json={"do": "undo"}).json()["fingerprint"]


def test_a_sweep_that_is_stopped_leaves_nothing_among_temporary_files(
    client, session, tmp_path, monkeypatch
):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    values = [f"{k} nm" for k in range(100, 600)]
    axes = [{"paths": ["machine.repeatability"], "values": values}]
    client.post("/api/start", json={"job": "sweep", "settings": {"axes": axes}})
    deadline = time.monotonic() + 60
    while not (found := list(folder.rglob("*.sqlite"))) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert found
    client.post("/api/stop", json={"id": 1})
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("body", ["[]", "{", '"x"', '{"do": ["move"]}', '{"do": {"a": 1}}'])
def test_what_is_no_action_is_answered_with_an_error(client, body):
    answer = client.post("/api/do", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code in (200, 400) and answer.json()["error"]


def test_the_map_of_lengths_is_that_of_the_page(client, design):
    found = client.post("/api/drawn", json={"map": "lengths", "motion": 0}).json()
    assert found["motions"] is None
    (experiment,) = load(design)
    lengths = length_map(experiment, (9, 9, 3))
    drawn = found["map"]
    assert drawn["scale"]["unit"] == "missed"
    assert drawn["scale"]["largest"] == pytest.approx(lengths.maximum_ratio.max())
    shares = {
        tuple(point): share
        for point, share in zip(lengths.points.round(9).tolist(), lengths.missed, strict=True)
    }
    for level in drawn["slices"]:
        for y, row in zip(drawn["y"], level["values"], strict=True):
            for x, value in zip(drawn["x"], row, strict=True):
                place = round(x, 9), round(y, 9), round(level["level"], 9)
                assert value == pytest.approx(shares[place], abs=1e-9)
    # Without a target it is in metres; where some lengths are undetermined, nothing is shown.
    text = client.get("/api/state").json()["text"].replace("target_uncertainty:", "# target:")
    client.post("/api/do", json={"do": "text", "text": text})
    found = client.post("/api/drawn", json={"map": "lengths"}).json()["map"]
    assert found["scale"]["unit"] == "m"
    known = [v for level in found["slices"] for row in level["values"] for v in row]
    assert 1e-8 < min(known) < max(known) < 1e-5
    for name in ("x low", "x high", "y low", "y high"):
        client.post("/api/do", json={"do": "off", "position": name})
    found = client.post("/api/drawn", json={"map": "lengths", "motion": 0}).json()
    assert {v for level in found["map"]["slices"] for row in level["values"] for v in row} == {None}
    assert client.post("/api/drawn", json={"map": ""}).json()["map"] is None


@pytest.mark.slow
def test_suggestions_are_what_the_file_becomes(client, design):
    client.post("/api/do", json={"do": "remove", "position": "y low"})
    client.post("/api/start", json={"job": "next"})
    (job,) = wait(client)
    assert job["state"] == "done"
    best, *others = job["result"]
    assert all(one["average"] >= best["average"] for one in others)
    answer = client.post("/api/do", json={"do": "add", "settings": best["settings"]}).json()
    lengths = next(one for one in answer["design"]["quantities"] if one["symbol"] == "U6")
    assert lengths["average"] == pytest.approx(best["average"], rel=1e-12)


@pytest.mark.slow
def test_dropped_readings_are_fitted(client, design):
    table = bp.simulate(design).to_csv(index=False).encode()
    content = base64.b64encode(table).decode()
    client.post(
        "/api/start", json={"job": "fit", "settings": {"name": "a.csv", "content": content}}
    )
    (job,) = wait(client)
    assert job["state"] == "done", job
    expected = bp.fit(design, bp.simulate(design))
    assert job["result"]["lines"] == expected.lines()
    assert len(job["result"]["residuals"]["value"]) == 250
