"""What a store keeps: every cell once, with its reasons, seeds and versions; what it refuses."""

from __future__ import annotations

import csv
import re
import sqlite3
from contextlib import chdir
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps import estimate, store_file, task
from ballplate.extensions.sweeps.answer import answer
from ballplate.extensions.sweeps.fingerprint import fingerprint
from ballplate.extensions.sweeps.load import experiment_of, load_sweep
from ballplate.extensions.sweeps.model import Sweep
from ballplate.extensions.sweeps.store import definitions, keys, open_store, results
from ballplate.extensions.sweeps.task import CellResult, CellTask, compute
from ballplate.montecarlo.experiments import trials
from ballplate.results.prediction import predict
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError, Message

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.support import assert_same, rows, run, small_sweep


def sweep(path: Path, *options: str) -> int:
    return main(["sweep", str(path), "--workers", "1", *options])


def count_cells(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of the cells that are computed from now on."""
    done = []

    def counted(loaded: Sweep, task: CellTask) -> CellResult:
        if task.block == 0:
            done.append(task.number)
        return compute(loaded, task)

    monkeypatch.setattr("ballplate.extensions.sweeps.local.compute", counted)
    return done


def test_figures_are_those_of_the_experiments(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = small_sweep(tmp_path, 4, "trials: 64\nrecord: [U4, U5]\n")
    assert sweep(path) == 1
    out, err = capsys.readouterr()
    assert out == f"{tmp_path}/small.sqlite: 8 cases, 6 done, 2 failed\n"
    assert (
        "case 6 failed: " in err
        and "quickstart.yaml" in err
        and str(tmp_path / "quickstart.yaml") not in err
    )
    table = rows(tmp_path / "small.sqlite")
    loaded = load_sweep(path)
    assert table["size_m"].tolist() == [choice[0].value for choice in map(loaded.choices, range(8))]
    assert table["balls"].tolist() == [4, 5] * 4
    assert table["status"].tolist() == ["done"] * 6 + ["failed"] * 2
    for k in (0, 5):
        experiment = experiment_of(loaded, k)
        expected = predict(experiment).quantities
        assert table["U4_maximum_m"][k] == expected["U4"].maximum
        assert table["U5_average_m"][k] == expected["U5"].average
        outcome = trials(experiment, 64, int(table["data_set_seed"][k])).outcome
        assert outcome is not None
        assert table["U4_spread_ratio"][k] == outcome.comparisons["U4"].spread.value
        assert table["U4_spread_ratio_standard_error"][k] == outcome.comparisons["U4"].spread.error
        assert table["trials"][k] == 64
    assert not [name for name in table if name.startswith(("U1", "U6"))]
    assert table["data_set_seed"][:6].nunique() == 6
    assert (table["ballplate_version"] == "0.1.0").all() and (table["blas_version"] != "").all()


def test_a_store_of_an_earlier_format_is_read_but_not_continued(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, store = small_sweep(tmp_path, 2), tmp_path / "small.sqlite"
    assert sweep(path) == 1
    right = rows(store)
    connection = sqlite3.connect(store)
    connection.execute("UPDATE about SET value = ?", [store_file.EARLIER])
    connection.commit()
    connection.close()
    before = store.read_bytes()
    assert_same(rows(store), right)
    capsys.readouterr()
    assert main(["sweep", "--export", str(store), "-o", "-"]) == 0
    assert capsys.readouterr().out.count("\n") == 5
    assert sweep(path) == 3
    assert wording.AN_EARLIER_VERSION in capsys.readouterr().err
    assert store.read_bytes() == before


def test_assumptions_are_assessed_for_the_cases_that_the_answer_names(tmp_path: Path) -> None:
    path, store = small_sweep(tmp_path, 2, "record: [U6]\n"), tmp_path / "small.sqlite"
    text = (tmp_path / "quickstart.yaml").read_text(encoding="utf-8")
    assumed = "assumptions: {temperature: 5 K}\n"
    (tmp_path / "quickstart.yaml").write_text(text + assumed, encoding="utf-8")
    assert sweep(path) == 1
    table = rows(store)
    expected = {}
    for case in answer(bp.stored(store)).outstanding:
        given = [
            one.given
            for one in predict(experiment_of(load_sweep(path), case)).qualifications
            if one.kind == "assumption"
        ]
        assert given
        expected[case] = f"{' and '.join(given)} (assessed for the first cases only)"
    done = table["status"] == "done"
    others = done.map({True: "exact probe offsets", False: ""})
    assert table["given"].tolist() == [expected.get(k, text) for k, text in enumerate(others)]


def test_the_first_failure_ends_a_run_and_is_tried_again_when_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = small_sweep(tmp_path, 2)
    assert sweep(path, "--fail-fast") == 1
    assert "2 done, 1 failed, 1 left" in capsys.readouterr().out
    counted = count_cells(monkeypatch)
    assert sweep(path, "--retry-failed") == 1
    assert "2 done, 2 failed" in capsys.readouterr().out
    assert sorted(counted) == [2, 3]
    # A further run computes nothing.
    assert sweep(path) == 1
    told = f"{tmp_path}/small.sqlite: 4 cases, 2 done, 2 failed (4 of them before)\n"
    assert capsys.readouterr().out == told and len(counted) == 2


def test_a_changed_base_is_refused_with_what_changed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = small_sweep(tmp_path, 2)
    sweep(path)
    base = tmp_path / "quickstart.yaml"
    text = base.read_text(encoding="utf-8")
    base.write_text("# Only a remark.\n" + text, encoding="utf-8")
    assert sweep(path) == 1
    base.write_text(
        text.replace("repeatability: 0.2 um", "repeatability: 0.3 um"), encoding="utf-8"
    )
    capsys.readouterr()
    assert sweep(path) == 3
    err = capsys.readouterr().err
    assert (
        "quickstart.yaml: machine.repeatability: '0.2 um' has become '0.3 um'" in err
        and "--beside" in err
    )
    assert sweep(path, "--beside") == 1
    store = open_store(tmp_path / "small.sqlite")
    assert len(definitions(store)) == 2
    assert keys(store, 1)[0] != keys(store, 2)[0]
    one, two = (results(store, k, 4).figures["U1_average_m"][0] for k in (1, 2))
    assert two > 1.1 * one
    store.close()
    # It is compared with the last one.
    base.write_text(text.replace("repeatability: 0.2 um", "repeatability: 0.4 um"), "utf-8")
    assert sweep(path) == 3 and "'0.3 um' has become '0.4 um'" in capsys.readouterr().err


def test_a_change_while_a_sweep_runs_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, base = small_sweep(tmp_path, 2), tmp_path / "quickstart.yaml"
    text = base.read_text(encoding="utf-8")

    def changing(loaded: Sweep, task: CellTask) -> CellResult:
        if task.number == 1:
            base.write_text(
                text.replace("repeatability: 0.2 um", "repeatability: 0.3 um"), encoding="utf-8"
            )
        return compute(loaded, task)

    monkeypatch.setattr("ballplate.extensions.sweeps.local.compute", changing)
    assert sweep(path) == 3
    assert wording.HAVE_CHANGED_WHILE_IT_RAN in capsys.readouterr().err
    # What was computed before the change is there, and nothing else.
    assert rows(tmp_path / "small.sqlite")["cell"].tolist() == [0]
    monkeypatch.undo()
    base.write_text(text, encoding="utf-8")
    assert sweep(path) == 1
    assert len(rows(tmp_path / "small.sqlite")) == 4


def test_what_two_sweeps_share_is_computed_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = small_sweep(tmp_path, 2)
    sweep(path)
    path.write_text(
        path.read_text(encoding="utf-8").replace("[4, 5]", "[4, 5, 6]"), encoding="utf-8"
    )
    counted = count_cells(monkeypatch)
    sweep(path, "--beside")
    # What is no valid experiment is judged anew.
    assert sorted(counted) == [2, 3, 4, 5]


def test_replicates_in_blocks_are_the_same_replicates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = small_sweep(tmp_path, 2, "trials: 520\nrecord: [U5]\n")
    assert task.BLOCK % 512 == 0
    monkeypatch.setattr("ballplate.extensions.sweeps.task.BLOCK", 512)
    assert sweep(path) == 1
    split = rows(tmp_path / "small.sqlite")
    monkeypatch.undo()
    assert sweep(path, "--store", str(tmp_path / "whole.sqlite")) == 1
    whole = rows(tmp_path / "whole.sqlite")
    assert split["trials"][0] == whole["trials"][0] == 520
    for name in ("U5_spread_ratio", "U5_coverage_sigma_given", "U5_actual_average_m"):
        np.testing.assert_allclose(split[name][:2], whole[name][:2], rtol=1e-12)
    store = open_store(tmp_path / "small.sqlite")
    assert store.connection.execute(
        "SELECT count(*) FROM result WHERE block > 0 AND status = 'done'"
    ).fetchone() == (0,)
    store.close()


QUICKSTART = "designs/quickstart.yaml"


@pytest.mark.parametrize(
    ("file", "old", "new", "differs"),
    [
        (QUICKSTART, "title: ", "title: another ", False),
        (QUICKSTART, "750 mm", "0.75 m", False),
        (QUICKSTART, "probes: [down]", "probes: [down], repeats: 1", False),
        # Defaults of the metric depend on the number of dimensions.
        ("designs/hurt_foss/bar-bell.yaml", "kind: metric}", "kind: metric, scale: each}", False),
        (
            "designs/hocken_borchardt/real.yaml",
            "    error_model.scale: none\n",
            "    error_model: {kind: metric}\n",
            False,
        ),
        (QUICKSTART, "seed: 7", "seed: 8", True),
        (QUICKSTART, "0.2 um ", "0.21 um ", True),
        (QUICKSTART, "z low", "z lower", True),
        (QUICKSTART, "random: 200", "random: 201", True),
    ],
)
def test_a_fingerprint_tells_what_matters(
    tmp_path: Path, file: str, old: str, new: str, differs: bool
) -> None:
    text = Path(file).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "b.yaml").write_text(text.replace(old, new), encoding="utf-8")
    one, other = ([*map(fingerprint, load(tmp_path / name))] for name in ("a.yaml", "b.yaml"))
    assert (one != other) == differs


def test_the_time_is_extrapolated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a case takes 1 s, and a data set 1 ms: all are computed in batches of 128."""

    def timed(loaded: Sweep, task: CellTask) -> CellResult:
        assert (loaded.trials or 0) % 128 == 0
        status, seconds = "failed" if task.number == 7 else "done", 1 + 1e-3 * (loaded.trials or 0)
        return CellResult(task.number, task.block, "", status, seconds=seconds)

    monkeypatch.setattr(estimate, "compute", timed)
    seconds, rows = estimate.seconds_of(load_sweep(small_sweep(tmp_path, 4, "trials: 1000\n")))
    assert [row.number for row in rows] == [0, 3, 7]
    assert seconds == pytest.approx(8 * (2 + 2 + 1) / 3)


def test_export(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import pandas

    path = small_sweep(tmp_path, 2)
    sweep(path)
    store, table = tmp_path / "small.sqlite", rows(tmp_path / "small.sqlite")
    for name in ("t.csv", "t.parquet", "t.xlsx"):
        assert main(["sweep", "--export", str(store), "-o", str(tmp_path / name)]) == 0
    # Not with pandas, some versions of which do not read every number to the last bit.
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as stream:
        written = list(csv.DictReader(stream))
    parquet = pandas.read_parquet(tmp_path / "t.parquet")
    workbook = pandas.read_excel(tmp_path / "t.xlsx")
    assert list(workbook) == list(written[0]) and len(workbook) == len(written)
    for name in table.select_dtypes("float"):
        np.testing.assert_allclose(workbook[name], table[name], rtol=1e-14)
        np.testing.assert_array_equal([float(row[name] or "nan") for row in written], table[name])
        np.testing.assert_array_equal(parquet[name], table[name])
    assert main(["sweep", "--export", str(store), "-o", str(tmp_path / "t.ods")]) == 2
    assert main(["sweep", "--export", str(store), "-o", str(tmp_path / "no" / "t.csv")]) == 3
    assert main(["sweep", "--export", str(store), "--sweep", "5", "-o", "-"]) == 3
    assert main(["sweep", "--export", str(tmp_path / "none.sqlite"), "-o", "-"]) == 3
    assert wording.THERE_IS_NO_SUCH_STORE in capsys.readouterr().err


MODEL = """
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.kinematic import kinematic_model
from NAME_helper import SIZE


def build(lower, upper, fails=False):
    model = kinematic_model(ARRANGEMENTS["MB2"], SIZE, 3, lower, upper)
    return Failing(model) if fails else model


class Failing:
    def __init__(self, model):
        self.model, self.calls = model, 0

    def __getattr__(self, name):
        return getattr(self.model, name)

    def error(self, x, a, p):
        if len(x) > 30:
            raise ValueError("no more than thirty")
        return self.model.error(x, a, p)
"""


def with_own_model(folder: Path, name: str, values: str) -> Path:
    """A sweep of an error model that imports another module."""
    (folder / f"{name}.py").write_text(MODEL.replace("NAME", name), encoding="utf-8")
    (folder / f"{name}_helper.py").write_text("SIZE = 3\n", encoding="utf-8")
    path = small_sweep(folder, 2)
    text = (folder / "quickstart.yaml").read_text(encoding="utf-8")
    before, _, after = text.partition("error_model:\n")
    model = f"error_model: {{kind: python, object: '{name}:build', options: {{fails: false}}}}"
    (folder / "quickstart.yaml").write_text(
        before + model + after[after.index("\n\n") :], encoding="utf-8"
    )
    axes = f"axes: {{fails: {{path: error_model.options.fails, values: {values}}}}}"
    path.write_text(f"title: t\nbase: quickstart.yaml\n{axes}\n", encoding="utf-8")
    return path


def test_what_a_users_model_imports_counts(tmp_path: Path) -> None:
    path = with_own_model(tmp_path, "imports_another", "[false]")
    assert run("sweep", path, "--workers", 1).returncode == 0
    (tmp_path / "imports_another_helper.py").write_text("SIZE = 4\n", encoding="utf-8")
    changed = run("sweep", path)
    assert (
        changed.returncode == 3 and "imports_another_helper.py: another content" in changed.stderr
    )
    assert run("sweep", path, "--beside", "--workers", 1).returncode == 0
    store = open_store(tmp_path / "small.sqlite")
    few, more = (results(store, k, 4).figures["parameters"][0] for k in (1, 2))
    store.close()
    assert more > few


def test_what_a_users_model_raises_is_the_rows_reason(tmp_path: Path) -> None:
    done = run("sweep", with_own_model(tmp_path, "raises_late", "[true, false]"), "--workers", 2)
    assert done.returncode == 1 and "2 cases, 1 done, 1 failed" in done.stdout, done.stderr
    place = re.search(r"raises_late\.py:[0-9]+: in error, code of your own: (.*)", done.stderr)
    assert place and place[1] == wording.NO_MORE_THAN_THIRTY


def test_rows_do_not_depend_on_where_the_command_is_started(tmp_path: Path) -> None:
    path = small_sweep(tmp_path, 2)
    (tmp_path / "sweeps").mkdir()
    text = path.read_text(encoding="utf-8").replace(
        "base: quickstart.yaml", "base: ../quickstart.yaml"
    )
    (tmp_path / "sweeps" / "s.yaml").write_text(text, encoding="utf-8")
    with chdir(tmp_path / "sweeps"):
        assert sweep(Path("s.yaml"), "--store", str(tmp_path / "1.sqlite")) == 1
    elsewhere = ("--store", str(tmp_path / "2.sqlite"))
    assert sweep(tmp_path / "sweeps" / "s.yaml", *elsewhere) == 1
    first = rows(tmp_path / "1.sqlite")
    assert first["reason"][2].startswith("../quickstart.yaml:40:5: positions[0]: ")
    assert_same(first, rows(tmp_path / "2.sqlite"))


def test_a_store_is_read_where_nothing_can_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = small_sweep(tmp_path, 2)
    sweep(path)
    before = sorted(file.name for file in tmp_path.iterdir())
    assert main(["sweep", "--export", str(tmp_path / "small.sqlite"), "-o", "-"]) == 0
    assert {file.name for file in tmp_path.iterdir()} <= {*before}
    with pytest.raises(sqlite3.OperationalError, match="readonly"):
        open_store(tmp_path / "small.sqlite").connection.execute("DELETE FROM result")
    assert (
        main(
            [
                "sweep",
                "--export",
                str(tmp_path / "small.sqlite"),
                "-o",
                str(tmp_path / "small.sqlite"),
            ]
        )
        == 2
    )


def test_whole_numbers_are_exported_as_they_are(tmp_path: Path) -> None:
    path = small_sweep(tmp_path, 2)
    values = [3, 9007199254740993, 18446744073709551616]
    axes = f"axes: {{noise: {{path: seed, values: {values}}}}}"
    path.write_text(f"title: t\nbase: quickstart.yaml\n{axes}\nrecord: [U5]\n", encoding="utf-8")
    assert sweep(path) == 0
    assert rows(tmp_path / "small.sqlite")["noise"].tolist() == [str(value) for value in values]


def test_a_cell_that_finds_no_memory_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded = load_sweep(small_sweep(tmp_path, 2, "trials: 10\n"))
    monkeypatch.setattr("ballplate.extensions.sweeps.task.predict", lambda *_: np.empty(1 << 58))
    row = compute(loaded, CellTask(0))
    assert row.status == "failed" and row.reason == (
        "it needs more memory than is available: there is no room for another 2.00 EiB; use fewer"
        " --workers, and --retry-failed to compute it again"
    )


def test_the_errors_of_a_cell_are_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a file that is wrong in two places, and of an error of a user's own in two lines."""
    loaded = load_sweep(small_sweep(tmp_path, 2))
    several = [Message("f.yaml", k, 1, "positions", "is wrong") for k in (3, 4)]
    for error, expected in (
        (
            ExperimentError(several),
            "f.yaml:3:1: positions: is wrong; f.yaml:4:1: positions: is wrong",
        ),
        (ValueError("one\ntwo"), "ValueError: one; two (test_sweep_store.py, line "),
    ):

        def fails(*_: object, error: Exception = error) -> None:
            raise error

        monkeypatch.setattr("ballplate.extensions.sweeps.task.predict", fails)
        row = compute(loaded, CellTask(0))
        assert row.status == "failed" and row.reason.startswith(expected)
