"""What the extension of a laboratory adds works in every command, as if it were the kernel's own:
lengths by a laser interferometer, a step gauge with balls, a key of the file.
"""

from __future__ import annotations

import csv
import io
import shutil
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.simulator.experiment import lay_out

from tests.reference import dense
from tests.reference.installed_extension import install, said_with

HERE = Path(__file__).parent
LASER: dict[str, Any] = yaml.safe_load((HERE / "laser.yaml").read_text(encoding="utf-8"))
ENDS = np.array([[[0, 0.5, 0.5], [1, 0.5, 0.5]], [[0, 0, 0], [1, 1, 1]]], float)
UNCERTAINTIES = np.array([5e-8, 1e-7])
OFFERED = {
    "name": "third",
    "price": "1 h",
    "kind": "laser",
    "start": ["0 mm", "1 m", "0 mm"],
    "end": ["1 m", "0 mm", "1 m"],
    "standard_uncertainty": "0.05 um",
}
PLACES = {"planes": ["z"], "levels": ["400 mm"], "corners": {"x": ["50 mm"], "y": ["50 mm"]}}

SCRIPT = """
import yaml
from ballplate.extensions.studio.document import experiment_of, opened

laser, gauge, pool = folder / "laser.yaml", folder / "step-gauge.yaml", folder / "pool.yaml"
readings, values, chosen = folder / "r.csv", folder / "c.csv", folder / "chosen.yaml"
page, fitted = folder / "fit.html", folder / "map.yaml"

def json_of(*words):
    status, out, err = said(*words, "--json")
    assert status == 0, (words, err)
    return json.loads(out)

simulated = said("simulate", laser, "-o", readings, "--certificate", values, "--seed", "3")
wide = bp.load(laser).with_(true_machine={
    "kind": "coefficients", "error_model": {"kind": "stretched"}, "values": {"scale": "50 ppm"},
})
exact, drawn = bp.simulate(wide, exact=True), folder / "drawn.csv"
sides = yaml.safe_load(laser.read_text())["calibration"][:1]
stretched = wide.with_(error_model={"kind": "stretched"}, calibration=sides)
bp.write_map(bp.fit(stretched, exact).to_map(), folder / "stretched-map.yaml")
experiment = bp.load(laser)
print(json.dumps({
    "check": said("check", laser),
    "run": json_of("run", laser),
    "simulate": simulated,
    "certificate": values.read_text(),
    "fit": json_of("fit", laser, readings, "--certificate", values),
    "report": said("fit", laser, readings, "--certificate", values, "--report", page, "-o", fitted),
    "page": page.read_text(),
    "plan": json_of("plan", pool, "--positions", "6", "-o", chosen),
    "chosen": chosen.read_text(),
    "run chosen": json_of("run", chosen),
    "compare": said("compare", laser, "--trials", "2"),
    "budget": json_of("run", laser, "--budget"),
    "reliability": said("run", laser, "--reliability"),
    "trials": bp.run(laser, trials=512).to_dict()["monte_carlo"]["quantities"],
    "schema": json.loads(said("schema")[1]),
    "studio": experiment_of(opened(laser)).extensions,
    "section": [experiment.sections["climate"].room, experiment.sections["climate"].air_changes],
    "wrong": said("check", folder / "wrong.yaml")[2],
    "misspelt": said("check", folder / "misspelt.yaml")[2],
    "gauge": [said("check", gauge), json_of("run", gauge), json_of("fit", gauge, folder / "g.csv")]
    if said("simulate", gauge, "-o", folder / "g.csv")[0] == 0 else [],
    "pairs": said("fit", gauge, folder / "g.csv", "--estimator", "distances", "--pairs", "neighbours"),
}))
"""


def files(folder: Path) -> Path:
    """Experiments of the laboratory, as they are and with mistakes."""
    for path in HERE.glob("*.yaml"):
        shutil.copy(path, folder)
    outside = {**LASER["calibration"][1], "end": ["1 m", "500 mm", "5 m"]}
    same = {**LASER["calibration"][1], "end": LASER["calibration"][1]["start"]}
    others = {
        "pool": {
            **LASER,
            "pool": {"candidates": [PLACES | {"probes": ["down"]}], "calibration": [OFFERED]},
        },
        "wrong": LASER | {"calibration": [outside, same], "climate": {"room": 3}},
        "misspelt": {key.replace("climate", "climat"): value for key, value in LASER.items()}
        | {"calibration": [LASER["calibration"][1] | {"kind": "lazer"}]},
    }
    for name, stated in others.items():
        text = yaml.safe_dump(stated, sort_keys=False)
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What commands say where the extension is installed."""
    installed = install(tmp_path_factory.mktemp("installed"))
    folder = files(tmp_path_factory.mktemp("work"))
    without = """print(json.dumps({"map": said("map", folder / "stretched-map.yaml")}))"""
    return {
        **said_with(installed, SCRIPT, folder),
        "map": yaml.safe_load((folder / "stretched-map.yaml").read_text(encoding="utf-8")),
        "map without": said_with(None, without, folder)["map"],
    }


def test_laser_lengths_count_as_in_a_dense_computation(told: dict[str, Any]) -> None:
    plain = {key: LASER[key] for key in LASER if key not in ("climate", "extensions")}
    problem = dense.planned(
        lay_out(bp.experiment(plain | {"calibration": plain["calibration"][:1]})), 3, 3
    )
    none = np.zeros((2, 3))

    def rows(step: dense.Values) -> dense.Values:
        a = dense.unpack(problem, step)[3]
        points = [dense.corrected(problem, ends, a, none) for ends in ENDS]
        lengths = np.array([dense.length(p[1:] - p[:1])[0] for p in points])
        return np.concatenate([dense.residuals(problem, step), lengths / UNCERTAINTIES])

    spread = dense.spread(dense.jacobian(rows, problem.parameters))
    expected = dense.standard_uncertainties(problem, spread, ["U4", "U5", "U6"])
    assert told["run"]["rank_deficiency"] == spread.deficiency == 0
    for symbol, values in expected.items():
        quantity = told["run"]["quantities"][symbol]
        assert quantity["average"] == pytest.approx(values.mean(), rel=1e-6)
        assert quantity["maximum"] == pytest.approx(values.max(), rel=1e-6)


def test_a_certificate_that_simulate_writes_is_read_by_fit(told: dict[str, Any]) -> None:
    assert told["simulate"][0] == 0
    rows = list(csv.DictReader(io.StringIO(told["certificate"].partition("\n")[2])))
    rows = [row for row in rows if row["first"] == "laser"]
    assert [row["item"] for row in rows] == ["calibration[1]", "calibration[2]"]
    lengths = [float(row["value"].removesuffix(" mm")) for row in rows]
    assert np.abs(np.array(lengths) - 1e3 * np.sqrt([1.0, 3.0])).max() < 0.1
    assert lengths != pytest.approx(1e3 * np.sqrt([1.0, 3.0]), abs=1e-5)
    fit = told["fit"]
    assert fit["status"] == "converged" and 0.7 < fit["sigma"] < 1.3
    assert told["report"][0] == 0 and "U7" in told["page"] and "climate" not in told["page"]


def test_a_map_names_the_extension_that_its_error_model_needs(told: dict[str, Any]) -> None:
    assert told["map"]["extensions"] == ["our_laboratory"]
    assert told["map"]["parameters"][0]["value"] == pytest.approx(50e-6, rel=1e-9)
    status, _, err = told["map without"]
    assert status == 3 and "extensions[0]" in err and "our_laboratory" in err, err
    assert err.count("\n") == 1, err


def test_the_schema_has_kinds_and_keys(told: dict[str, Any]) -> None:
    schema = told["schema"]
    kinds = ("LaserSettings", "PricedLaserSettings", "StepGaugeSettings", "StyliSettings")
    assert {*kinds, "StretchedSettings", "ClimateSettings"} <= set(schema["$defs"])
    assert schema["properties"]["climate"] == {"$ref": "#/$defs/ClimateSettings"}
    offered = [kind["$ref"] for kind in schema["properties"]["calibration"]["items"]["oneOf"]]
    assert "#/$defs/LaserSettings" in offered


def test_mistakes_are_told_at_their_place(told: dict[str, Any]) -> None:
    assert "calibration[0].end: is outside the measuring volume" in told["wrong"]
    assert "calibration[1].end: is where the length starts" in told["wrong"]
    assert "climate.room: expected a text, found the number 3" in told["wrong"]
    assert 'calibration[0].kind: unknown kind "lazer"; did you mean "laser"?' in told["misspelt"]
    assert 'climat: unknown key; did you mean "climate"?' in told["misspelt"]


def test_a_step_gauge_is_carried_to_a_fit(told: dict[str, Any]) -> None:
    check, run, fit = told["gauge"]
    assert check[0] == 0 and run["rank_deficiency"] == 0 and fit["status"] == "converged"
    for name, true in {"alpha": 5e-6, "gamma": 8e-6}.items():
        one = fit["estimates"][name]
        assert abs(one["value"] - true) < 4.0 * one["standard_uncertainty"]
    assert told["pairs"][0] == 0


def test_what_is_lacking_is_named(tmp_path: Path) -> None:
    work = files(tmp_path)
    without = said_with(
        None, 'print(json.dumps({"c": said("check", folder / "laser.yaml")}))', work
    )
    status, _, err = without["c"]
    assert status == 3
    assert 'unknown kind "laser"' in err and "if an extension provides it, install that" in err
    assert 'extensions[0]: the extension "our_laboratory", which this file needs' in err
    assert "climate: unknown key" in err


TWICE = """
[build-system]
[project]
name = "other-laboratory"
version = "2.0"
[project.entry-points."ballplate.extensions"]
other = "other_laboratory:EXTENSION"
"""


@pytest.mark.parametrize(
    ("provided", "words"),
    [
        ('quantities={"U4": "a"}', "U4 (quantities) is provided by ballplate"),
        ('calibrations={"laser": "a"}', "laser (calibrations) is provided by our_laboratory"),
        *(
            pytest.param(
                f'{kind}={{"{name}": "a"}}',
                f"{name} ({kind}) is provided by ballplate",
                marks=pytest.mark.long,
            )
            for kind, name in (
                *(("calibrations", "distances"), ("sections", "positions"), ("artefacts", "grid")),
                *(("influences", "sag"), ("error_models", "metric")),
            )
        ),
    ],
)
def test_a_name_that_is_used_twice_is_refused(provided: str, words: str, tmp_path: Path) -> None:
    package = tmp_path / "package"
    (package / "other_laboratory").mkdir(parents=True)
    (package / "pyproject.toml").write_text(TWICE, encoding="utf-8")
    (package / "other_laboratory" / "__init__.py").write_text(
        "from ballplate import Extension\n"
        f'EXTENSION = Extension("other", "other_laboratory", {provided})\n',
        encoding="utf-8",
    )
    installed = tmp_path / "installed"
    installed.mkdir()
    install(install(installed), package)
    script = 'print(json.dumps({"help": said("--help")}))'
    err = said_with(installed, script, tmp_path)["help"][2]
    assert "entry point other of other-laboratory is not used: " in err and words in err


@pytest.mark.parametrize(
    ("module", "words"),
    [
        ("", "module laser has no SETTINGS, which calibrations need"),
        ("SETTINGS = 1", "SETTINGS of laser is no Settings with kind: Literal['laser']"),
        ("1 / 0", "module laser cannot be loaded (ZeroDivisionError"),
    ],
)
def test_a_kind_that_cannot_be_used_is_told(module: str, words: str, tmp_path: Path) -> None:
    installed = tmp_path / "installed"
    installed.mkdir()
    install(installed)
    (installed / "our_laboratory" / "laser.py").write_text(module + "\n", encoding="utf-8")
    work = tmp_path / "work"
    work.mkdir()
    script = 'print(json.dumps({"c": said("check", folder / "laser.yaml")}))'
    status, _, err = said_with(installed, script, files(work))["c"]
    assert status == 3 and f"extension our_laboratory: {words}" in err, err


def test_code_of_an_extension_that_fails_is_named(tmp_path: Path) -> None:
    """By file and line and its extension, and not as a fault of ballplate."""
    installed = tmp_path / "installed"
    installed.mkdir()
    install(installed)
    laser = installed / "our_laboratory" / "laser.py"
    code = laser.read_text(encoding="utf-8")
    head = "    def rows("
    assert code.count(head) == 1
    before, after = code.split(head)
    body = after.index(":\n", after.index("->")) + 2
    laser.write_text(f"{before}{head}{after[:body]}        1 / 0\n{after[body:]}", encoding="utf-8")
    work = tmp_path / "work"
    work.mkdir()
    script = 'print(json.dumps({"c": said("check", folder / "laser.yaml")}))'
    status, _, err = said_with(installed, script, files(work))["c"]
    line = code[: code.index(head)].count("\n") + after[:body].count("\n") + 1
    assert status == 3, err
    assert f"laser.py:{line}: extension our_laboratory: ZeroDivisionError: division by zero" in err
    assert "internal error" not in err


def test_a_package_that_cannot_be_loaded_is_named(tmp_path: Path) -> None:
    """Where a file needs it, and as a warning where its quantities lack in a table."""
    installed = tmp_path / "installed"
    installed.mkdir()
    install(installed)
    path = installed / "our_laboratory" / "__init__.py"
    path.write_text("import nowhere_at_all\n" + path.read_text(encoding="utf-8"), encoding="utf-8")
    work = tmp_path / "work"
    work.mkdir()
    script = """
from ballplate.designs import shipped
designs = {"check": folder / "laser.yaml", "run": shipped("quickstart.yaml")}
print(json.dumps({command: said(command, design) for command, design in designs.items()}))"""
    found = said_with(installed, script, files(work))
    words = "is not used: ModuleNotFoundError: No module named 'nowhere_at_all'"
    assert found["check"][0] == 3 and words in found["check"][2]
    assert "warning: entry point" in found["run"][2] and words in found["run"][2]


def test_a_key_whose_settings_are_none_is_told(tmp_path: Path) -> None:
    installed = tmp_path / "installed"
    installed.mkdir()
    install(installed)
    (installed / "our_laboratory" / "climate.py").write_text("SETTINGS = 1\n", encoding="utf-8")
    work = tmp_path / "work"
    work.mkdir()
    script = 'print(json.dumps({"c": said("check", folder / "laser.yaml")}))'
    status, _, err = said_with(installed, script, files(work))["c"]
    assert status == 3 and "SETTINGS of the section climate is no Settings" in err, err
