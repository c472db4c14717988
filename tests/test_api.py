"""From Python: the same figures as from the command, and experiments changed and written there."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
import yaml
from ballplate.cli import main

from tests.reference.tables import read_table

QUICKSTART = "designs/quickstart.yaml"


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    """What a command prints as JSON."""
    assert main([*arguments, "--json"]) in (0, 1)
    return json.loads(capsys.readouterr().out)


def test_results_are_those_of_the_commands(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "readings.csv"
    readings = bp.simulate(QUICKSTART)
    readings.to_csv(file, index=False)
    assert main(["simulate", QUICKSTART, "-o", str(tmp_path / "other.csv")]) == 0
    assert file.read_bytes() == (tmp_path / "other.csv").read_bytes()
    assert bp.check(QUICKSTART).to_dict() == printed(capsys, "check", QUICKSTART)
    assert bp.run(QUICKSTART, trials=20).to_dict() == printed(
        capsys, "run", QUICKSTART, "--trials", "20"
    )
    assert bp.fit(QUICKSTART, file).to_dict() == printed(capsys, "fit", QUICKSTART, str(file))
    assert bp.reliability(QUICKSTART).to_dict() == printed(
        capsys, "run", "--reliability", QUICKSTART
    )
    assert bp.reach(QUICKSTART).to_dict() == printed(capsys, "reach", QUICKSTART)


def test_a_changed_experiment_is_one_with_the_text_changed(tmp_path: Path) -> None:
    text = (
        Path(QUICKSTART)
        .read_text("utf-8")
        .replace("repeatability: 0.2 um", "repeatability: 0.4 um")
    )
    file = tmp_path / "changed.yaml"
    file.write_text(text.replace("balls: [5, 5]", "balls: [7, 7]"), "utf-8")
    changed = (
        bp.quickstart()
        .with_({"machine.repeatability": "0.4 um"})
        .with_({"artefacts.plate.balls": [7, 7]})
    )
    assert bp.run(changed).quantities == bp.run(file).quantities
    assert bp.run(bp.quickstart()).quantities == bp.run(QUICKSTART).quantities


def test_sections_are_replaced_and_entries_removed() -> None:
    given = bp.quickstart().with_(target_uncertainty="1 um", title="another")
    assert given.title == "another" and given.target_uncertainty is not None
    assert given.with_(target_uncertainty=None).target_uncertainty is None
    less = given.with_({"positions[z high]": None})
    assert [one.name for one in less.positions] == ["z low", "x low", "x high", "y low", "y high"]
    assert len(given.positions) == 6


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"machine.repeatability": "1 kg"}, "machine.repeatability: .*unknown unit"),
        ({"machine.repeatibility": "1 um"}, "unknown key; did you mean"),
        ({"positions[z middle]": None}, 'there is no "z middle" in positions'),
        ({"positions[9]": None}, r"there is no positions\[9\]"),
        ({"seed": object()}, "an? object cannot be written"),
        ({"machine.volume": None}, 'missing; add "volume"'),
    ],
)
def test_wrong_changes_are_refused_with_their_path(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(bp.ExperimentError, match=told):
        bp.quickstart().with_(changes)


def test_an_experiment_written_in_python(tmp_path: Path) -> None:
    sections = {
        "title": "two positions",
        "machine": {"volume": ["600 mm", "600 mm"], "repeatability": "0.5 um"},
        "error_model": {"kind": "metric"},
        "artefacts": {"plate": {"kind": "grid", "balls": [4, 4], "size": ["300 mm", "300 mm"]}},
        "positions": [
            {"name": "straight", "corner": {"x": "100 mm", "y": "100 mm"}},
            {"name": "turned", "corner": {"x": "200 mm", "y": "200 mm"}, "quarter_turns": 1},
        ],
    }
    file = tmp_path / "experiment.yaml"
    file.write_text(yaml.safe_dump(sections), "utf-8")
    given = bp.experiment(sections)
    assert bp.run(given).to_dict() == bp.run(file).to_dict()
    assert bp.run(given).quantities["U1"].count == 32
    with pytest.raises(bp.ExperimentError, match='experiment: title: missing; add "title"'):
        bp.experiment({})
    with pytest.raises(bp.ExperimentError, match="variants: are for files"):
        bp.experiment({"variants": {}})


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: bp.run(QUICKSTART, trials=0), "trials=0; give 2 at least"),
        (lambda: bp.run(QUICKSTART, trials=1), "trials=1; give 2 at least"),
        (lambda: bp.run(QUICKSTART, until=0.0), r"until=0.0; give a ratio above 0"),
        (lambda: bp.run(QUICKSTART, until=5), r"until=5; give a ratio above 0 and at most 1"),
        (
            lambda: bp.fit(QUICKSTART, "none.csv", sigma="givn"),
            'sigma: "givn" is unknown; did you mean "given"',
        ),
        (
            lambda: bp.reliability(QUICKSTART, sigma="Given"),
            'sigma: "Given" is unknown; did you mean "given"',
        ),
        (lambda: bp.reliability(QUICKSTART, power=1.0), "power=1.0; give a ratio between"),
        (
            lambda: bp.reliability(QUICKSTART, false_alarm=0.9),
            "false_alarm=0.9, power=0.8; .* the power the larger",
        ),
        (lambda: bp.plan(QUICKSTART, "u6"), 'criterion: "u6" is unknown; did you mean "U6"'),
        (
            lambda: bp.reach(QUICKSTART, unknowns=["repeatabilty"]),
            'unknowns: "repeatabilty" is unknown; did you mean',
        ),
        (
            lambda: bp.plan("designs/planning/plate-pool.yaml", hours=-1.0),
            "hours=-1.0; give hours above 0",
        ),
        (
            lambda: bp.plan("designs/planning/plate-pool.yaml", positions=0),
            "positions=0; give 1 at least",
        ),
        (lambda: bp.run(QUICKSTART, until=float("nan")), "until=nan; give a ratio above 0"),
        (
            lambda: bp.sweep("designs/sweeps/plate-size.yaml", workers=0),
            "workers=0; give 1 at least",
        ),
        (
            lambda: bp.reach(QUICKSTART, unknowns="rows"),
            'unknowns: "rows" is unknown; known: repeatability',
        ),
        (lambda: bp.budget(QUICKSTART, by=None), 'by: "None" is unknown; known: axis'),  # type: ignore[arg-type]
        (
            lambda: bp.diff("a.yaml", "b.yaml", dates=("2026-11-22",)),  # type: ignore[arg-type]
            "dates=.*; give two",
        ),
    ],
)
def test_wrong_arguments_are_refused(call: Callable[[], object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        call()


def test_a_single_unknown_needs_no_list() -> None:
    (answer,) = bp.reach(QUICKSTART, "U6 average 0.2 um", "repeatability").answers
    assert answer.name == "repeatability"


def test_variants_are_chosen_by_name() -> None:
    with pytest.raises(bp.ExperimentError, match="several variants; choose one"):
        bp.load("designs/npl/6.1.1.yaml")
    with pytest.raises(bp.ExperimentError, match='no variant "E"; '):
        bp.load("designs/npl/6.1.1.yaml", variant="E")
    with pytest.raises(bp.ExperimentError, match="the file has no variants"):
        bp.load(QUICKSTART, variant="A")


def test_results_show_themselves() -> None:
    for result in (
        bp.check(QUICKSTART),
        bp.run(QUICKSTART, trials=5),
        bp.fit(QUICKSTART, bp.simulate(QUICKSTART)),
    ):
        assert len(repr(result)) < 200 and "quickstart" in repr(result)
        assert str(result).startswith("quickstart: 5 x 5 ball plate in six positions\n")
        assert len(result.to_frame()) == len(result.rows())
        html = result._repr_html_()
        assert (
            html.count("<table") == html.count("</table>") == bool(result.rows())
            and "quickstart" in html
        )
        json.dumps(result.to_dict(), allow_nan=False)


def test_a_sweep_goes_on_where_it_ended(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "base.yaml").write_text(Path(QUICKSTART).read_text("utf-8"), "utf-8")
    text = (
        "title: repeatability\nbase: base.yaml\naxes: {u: {path: machine.repeatability, values:"
        " [0.1 um, 0.2 um]}}\n"
    )
    file, store = tmp_path / "small.yaml", tmp_path / "small.sqlite"
    file.write_text(text, "utf-8")
    found = bp.sweep(file)
    assert (
        found.summary.done == 2
        and found.summary.before == 0
        and repr(found).endswith("2 cases, 2 done, 0 failed>")
    )
    assert len(found.to_frame()) == 2 and found.to_dict()["store"] == str(store)
    again = bp.sweep(file)
    assert again.summary.before == 2
    assert main(["sweep", "--export", str(store), "-o", str(tmp_path / "table.csv")]) == 0
    exported = read_table(tmp_path / "table.csv")
    assert exported["U6_average_m"].tolist() == found.table["U6_average_m"].tolist()
    assert bp.stored(store).to_frame().equals(again.to_frame())
    assert main(["sweep", "--report", str(store), "-o", str(tmp_path / "r.md")]) == 0
    assert (tmp_path / "r.md").read_text("utf-8") == bp.stored(store).to_markdown()
    damaged = tmp_path / "damaged.sqlite"
    damaged.write_bytes(store.read_bytes())
    with closing(sqlite3.connect(damaged)) as connection, connection:
        connection.execute("UPDATE result SET figures = '{}' WHERE rowid = 1")
    for use in (lambda: bp.stored(damaged), lambda: bp.sweep(file, damaged)):
        with pytest.raises(bp.StoreError, match="is damaged .* reads the undamaged cases"):
            use()
    file.write_text(text.replace("0.2 um", "0.3 um"), "utf-8")
    with pytest.raises(bp.OtherSweepError, match="holds another sweep; what has changed"):
        bp.sweep(file)
    assert bp.sweep(file, beside=True).summary.before == 1
    assert len({bp.stored(store, k).to_frame()["U6_average_m"][1] for k in (1, 2)}) == 2
    with pytest.raises(bp.StoreError, match="no such sweep; it has 1, 2"):
        bp.stored(store, 3)
    store.write_text("no store", "utf-8")
    for use in (lambda: bp.sweep(file), lambda: bp.stored(store)):
        with pytest.raises(bp.StoreError, match="is no store of ballplate sweep"):
            use()
