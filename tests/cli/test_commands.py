"""The commands as a user meets them: output, exit status, and nothing else."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.cli._parsers import GROUPS, commands_of_all
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.machines.truth import true_parameters

from tests.cli import wording
from tests.reference.small_plate import PLATE

QUICKSTART = "designs/quickstart.yaml"
SYMBOLS = ("U1", "U2", "U3", "U4", "U5", "U6")


def run(*arguments: str | Path) -> int:
    return main([str(argument) for argument in arguments])


def test_run_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("run", "--json", QUICKSTART) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["experiment"] == "quickstart"
    assert (
        found["parameters"],
        found["observations"],
        found["rank_deficiency"],
        found["sigma"],
    ) == (174, 754, 0, 1)
    for symbol in SYMBOLS:
        quantity = found["quantities"][symbol]
        assert 0 < quantity["average"] <= quantity["maximum"]
    assert found["quantities"]["U2 angles"]["unit"] == "rad"
    lengths, angles = found["quantities"]["U2 lengths"], found["quantities"]["U2 angles"]
    mixed = (lengths["average"] * lengths["count"] + angles["average"] * angles["count"]) / 30
    assert found["quantities"]["U2"]["average"] == pytest.approx(mixed)


def test_run_shows_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("run", QUICKSTART) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines if line[:1] == "U"] == list(SYMBOLS)
    # Lengths and angles have rows of their own, and points their place.
    assert not any("µm, µrad" in line for line in lines)
    points = lay_out(load(QUICKSTART)[0]).evaluation.points
    places = dict(re.findall(r"(point [0-9]+) at \(([0-9., ]+)\) mm", "\n".join(lines)))
    named = re.findall(
        r"point [0-9]+", "\n".join(line for line in lines if line[:2] in ("U4", "U6"))
    )
    assert len(named) == 3 and set(places) == set(named)
    for name, place in places.items():
        assert [float(one) for one in place.split(", ")] == (1e3 * points[int(name[6:]) - 1]).round(
            1
        ).tolist()
    assert max(map(len, lines)) <= 120


def test_simulate_and_fit(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    readings = tmp_path / "readings.csv"
    assert run("simulate", QUICKSTART, "-o", readings) == 0
    first = readings.read_bytes()
    for seed, same in (("1", True), ("2", False)):
        assert run("simulate", QUICKSTART, "-o", readings, "--force", "--seed", seed) == 0
        assert (readings.read_bytes() == first) is same
    out, err = capsys.readouterr()
    assert out == "" and "250 readings written" in err

    assert run("fit", "--json", QUICKSTART, readings) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "converged" and len(found["iterations"]) <= 6
    assert 0.8 < found["sigma"] < 1.2
    experiment = load(QUICKSTART)[0]
    design = lay_out(experiment)
    truth = true_parameters(experiment.true_machine, design.model)
    names = [parameter.name for parameter in design.model.parameters]
    errors = [
        (found["estimates"][name]["value"] - value)
        / found["estimates"][name]["standard_uncertainty"]
        for name, value in zip(names, truth, strict=True)
    ]
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.6
    assert {entry["unit"] for entry in found["estimates"].values()} == {"m", "rad"}
    assert len(found["estimates"]) == found["parameters"]


def test_exact_readings_fit_exactly(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    readings = tmp_path / "readings.csv"
    assert run("simulate", QUICKSTART, "-o", readings, "--exact") == 0
    assert run("fit", "--json", QUICKSTART, readings, "--sigma", "given", "--monomials") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["sigma"] == 1.0 and not found["sigma_is_estimated"]
    assert found["sum_of_squares"] < 1e-12
    experiment = load(QUICKSTART)[0]
    model = lay_out(experiment).model
    values = model.reported().matrix @ true_parameters(experiment.true_machine, model)
    for name, value in zip(model.reported().names, values, strict=True):
        assert found["estimates"][name]["value"] == pytest.approx(value, abs=2e-12)


def test_fit_names_missing_and_unplanned_readings(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    readings = tmp_path / "readings.csv"
    run("simulate", QUICKSTART, "-o", readings)
    header, first, second, *rest = readings.read_text(encoding="utf-8").splitlines()
    position, ball, _, x, y, z = second.split(",")
    # The same ball with another probe: its tip is elsewhere by the difference of the offsets.
    other = f"{position},{ball},right,{float(x) - 50},{y},{float(z) - 50}"
    readings.write_text("\n".join([header, second, other, *rest]) + "\n", encoding="utf-8")
    capsys.readouterr()
    assert run("fit", QUICKSTART, readings) == 0
    _, err = capsys.readouterr()
    assert wording.PLANNED_BUT_NOT_READ_LOW in err
    assert wording.READ_BUT_NOT_PLANNED_LOW in err


def quickstart_readings(folder: Path, *options: str) -> tuple[Path, list[str]]:
    path = folder / "readings.csv"
    run("simulate", QUICKSTART, "-o", path, *options)
    return path, path.read_text(encoding="utf-8").splitlines()


def test_nothing_is_made_of_a_failed_estimate(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Readings as wrong as these are refused before.
    monkeypatch.setattr(
        "ballplate.extensions.laboratory.reading_checks.ReadingChecks.refuse_gross_errors",
        lambda *_: None,
    )
    readings, lines = quickstart_readings(tmp_path)
    readings.write_text(
        "\n".join([lines[0], *(f"{line.rsplit(',', 3)[0]},0,0,0" for line in lines[1:])]), "utf-8"
    )
    capsys.readouterr()
    assert run("fit", "--json", QUICKSTART, readings) == 1
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert found["status"] == "diverged" and found["quantities"] == {} and found["estimates"] == {}
    assert wording.THE_ESTIMATE_HAS_DIVERGED in err
    assert run("fit", QUICKSTART, readings) == 1
    assert "U1" not in capsys.readouterr().out


def test_simulated_certificates_are_wrong_by_their_uncertainty(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Otherwise the residuals would be too small and sigma with them."""
    found = []
    for seed in range(4):
        path = tmp_path / f"{seed}.csv"
        run("simulate", "designs/npl/6.1.1.yaml", "--variant", "C", "-o", path, "--seed", str(seed))
        capsys.readouterr()
        run("fit", "--json", "designs/npl/6.1.1.yaml", "--variant", "C", path)
        fit = json.loads(capsys.readouterr().out)
        found.append(fit["sum_of_squares"])
    freedom = fit["degrees_of_freedom"]
    assert abs(np.mean(found) - freedom) < 4 * np.sqrt(2 * freedom / len(found))


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"ballplate {version('ballplate')}\n"


def test_init_writes_the_quickstart(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    assert run("init", path) == 0
    assert path.read_text(encoding="utf-8") == Path(QUICKSTART).read_text(encoding="utf-8")
    assert run("check", path) == 0
    assert run("init", path) == 3
    assert run("init", tmp_path / "no" / "folder.yaml") == 3
    assert "exists already" in capsys.readouterr().err


def test_init_writes_a_machine(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "machine.yaml"
    assert run("init", "--machine", path) == 0
    assert f"next: ballplate map {path}" in capsys.readouterr().err
    assert run("map", path) == 0
    assert "largest resultant 24.81 µm at (800," in capsys.readouterr().out
    text = path.read_text(encoding="utf-8")
    schema = json.loads(Path("designs/machine-schema.json").read_text(encoding="utf-8"))
    for part in (schema, *schema["$defs"].values()):
        for key in part.get("properties", {}):
            # One error stands for the others.
            assert key[0] == "E" and len(key) == 3 or re.search(rf"\b{key}:", text), key
    # What stands in comments is right as well.
    lines = text.splitlines()
    begins = next(k for k, line in enumerate(lines) if "  #   # line" in line)
    table = [line.removeprefix("  #   ") for line in lines[begins:] if line.startswith("  #   ")]
    (tmp_path / "ezx.csv").write_text("\n".join([*table, "800,0,1"]), encoding="utf-8")
    text = (
        text.replace("# EZX: {", "EZX: {").replace("# EXY: {", "EXY: {").replace("# droop", "droop")
    )
    path.write_text(
        text.replace("arrangement: MB2", "arrangement: {probe_side: [x, z], workpiece_side: [y]}")
    )
    assert run("map", path) == 3
    (message,) = capsys.readouterr().err.strip().split("\n")
    assert wording.ONLY_THE_ARM_OF_DROOPS in message
    path.write_text(path.read_text(encoding="utf-8").replace("droop: {", "# {"), encoding="utf-8")
    assert run("map", "--curves", path) == 0
    assert "table of 3 points at y = 300 mm, z = 400 mm, minimum zone" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("experiment", "schema.json"),
        ("sweep", "sweep-schema.json"),
        ("machine", "machine-schema.json"),
        ("map", "map-schema.json"),
    ],
)
def test_schema_is_the_shipped_one(
    kind: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("schema", kind) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == json.loads(Path("designs", name).read_text(encoding="utf-8"))


def test_shipped_files_name_their_schema() -> None:
    for path in Path("designs").rglob("*.yaml"):
        first = path.read_text(encoding="utf-8").splitlines()[0]
        named = first.partition("$schema=")[2]
        expected = {
            "sweeps": "sweep-schema.json",
            "machines": "machine-schema.json",
            "parts": "part-schema.json",
        }.get(path.parent.name, "schema.json")
        assert (path.parent / named).resolve() == Path("designs", expected).resolve(), path


@pytest.mark.parametrize(
    "arguments", [["chekc"], ["check"], ["run", "--what"], ["simulate", QUICKSTART]]
)
def test_usage_is_status_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    out, err = capsys.readouterr()
    assert out == "" and "usage: ballplate" in err


DESIGNS = sorted(
    path
    for path in Path("designs").rglob("*.yaml")
    if path.parent.name not in ("sweeps", "machines", "parts")
)
# Plates in space and in the plane, splines, bars and gauges, a published deficiency.
FEW = (
    "quickstart",
    "6.1.1",
    "dummy",
    "scales-in-two-parts",
    "bar-bell",
    "bryan-gauge",
    "deficient",
)


@pytest.mark.parametrize("few", [True, pytest.param(False, marks=pytest.mark.long)])
def test_shipped_designs_are_as_expected(few: bool) -> None:
    paths = [path for path in DESIGNS if path.stem in FEW or not few]
    assert len(paths) >= len(FEW)
    assert run("check", *paths) == 0
    assert run("run", *paths) == 0


def test_checking_loads_nothing_slow() -> None:
    """A check must start fast: no pandas, plotting or processes."""
    code = (
        "import sys; from ballplate.cli import main; main(['check',"
        " 'designs/quickstart.yaml']);print([m for m in ('pandas', 'joblib', 'matplotlib')"
        " if m in sys.modules], file=sys.stderr)"
    )
    found = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.getcwd()},
    )
    assert found.stderr.strip() == "[]"


def test_an_error_of_the_program_is_not_called_a_failed_check() -> None:
    """Status 1 would say that a design is not as expected. In a process of its own, since the
    command keeps the signals of the one in which it is started.
    """
    code = (
        "import sys\n"
        "import ballplate.results.checked_files as checked_files\n"
        "from ballplate.__main__ import main\n"
        "def broken(*_):\n"
        "    raise AssertionError('two is one')\n"
        "checked_files.check_files = broken\n"
        "sys.argv = ['ballplate', 'check', 'designs/quickstart.yaml']\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 70
    message = "internal error: AssertionError: two is one. Please report"
    assert "Traceback" in done.stderr and message in done.stderr


def test_help_lists_all_commands_in_groups(capsys: pytest.CaptureFixture[str]) -> None:
    """Also where no command is named, which is wrong usage."""
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    help_text = capsys.readouterr().out
    assert ended.value.code == 0
    assert main([]) == 2 and capsys.readouterr().err == help_text
    of_group: dict[str, list[str]] = {}
    for line in help_text[help_text.index("commands:") :].splitlines():
        if line[1:] in GROUPS.values():
            of_group[line[1:]] = []
        elif found := re.match(r"  ([a-z]+)\s", line):
            list(of_group.values())[-1].append(found[1])
    assert list(of_group) == list(GROUPS.values())
    listed = [name for names in of_group.values() for name in names]
    assert sorted(listed) == sorted(name for name in commands_of_all() if " " not in name)
    assert len(listed) - len(of_group["more"]) <= 20


def test_fit_reads_the_tables_that_the_file_names(tmp_path: Path) -> None:
    path = tmp_path / "plate.yaml"
    path.write_text(PLATE + "readings: {files: r.csv}\n", encoding="utf-8")
    assert run("simulate", path, "-o", tmp_path / "r.csv") == 0
    assert run("fit", path) == 0
