"""Nothing runs, and nothing is read, that was not allowed: every key that names a file or code, through every
door by which a file comes that nobody has opened.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.designs import shipped
from ballplate.extensions.studio.jobs import JOBS
from ballplate.extensions.studio.session import Session
from ballplate.simulator.inputs.yamltree import parse_tree, to_list, to_python

BASE = to_list(
    to_python(parse_tree(Path(shipped("quickstart.yaml")).read_text(), "quickstart.yaml"))
)
PLATE = {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]}
BAR = {"kind": "balls", "coordinates": {"a": ["0 mm", "0 mm"], "b": ["500 mm", "0 mm"]}}

opened: list[str] = []
is_watching = False


def watch(event: str, arguments: tuple[Any, ...]) -> None:
    if is_watching and event == "open" and isinstance(arguments[0], (str, bytes)):
        name = arguments[0]
        opened.append(name if isinstance(name, str) else name.decode(errors="replace"))


sys.addaudithook(watch)


@pytest.fixture
def watched() -> Iterator[list[str]]:
    """Names of the files that are opened while a test runs."""
    global is_watching
    opened.clear()
    is_watching = True
    yield opened
    is_watching = False


def calibrated(**settings: Any) -> dict[str, Any]:
    return {"calibration": [settings]}


def python(folder: str, kind: str = "python") -> dict[str, Any]:
    return {"kind": kind, "object": "canary:build", "folder": folder}


# Sections of an experiment with each key that names a file, by the key's class and name in the schema; {0} is the
# folder with what must not be touched.
READ: dict[str, dict[str, Any]] = {
    "BallsSettings.file": {"artefacts": {"plate": {"kind": "balls", "file": "{0}/balls.csv"}}},
    "CompensationSettings.file": {"readings": {"compensation": {"file": "{0}/machine.yaml"}}},
    "CoordinatesSettings.values": calibrated(kind="coordinates", values="{0}/balls.csv"),
    "CoordinatesSettings.covariance": calibrated(
        kind="coordinates", balls="all", covariance="{0}/covariance.csv"
    ),
    "CurvesSettings.files": {"true_machine": {"kind": "curves", "files": ["{0}/curves.csv"]}},
    "DistancesSettings.values": calibrated(
        kind="distances", pairs="all", values="{0}/distances.csv"
    ),
    "DistancesSettings.covariance": calibrated(
        kind="distances", pairs="corners", covariance="{0}/covariance.csv"
    ),
    "MachineFileSettings.file": {"error_model": {"kind": "machine", "file": "{0}/machine.yaml"}},
    "MapPriorSettings.file": {"priors": [{"kind": "map", "file": "{0}/map.yaml"}]},
    "PartOfExperiment.file": {"part": {"file": "{0}/part.yaml"}},
    "PointsSettings.file": {"evaluation": {"points": {"file": "{0}/points.csv"}, "probe": "down"}},
    "PythonValuesSettings.object": calibrated(**python("{0}")),
    "PythonValuesSettings.values": calibrated(**python("{0}"), values="{0}/distances.csv"),
    "PythonValuesSettings.covariance": calibrated(**python("{0}"), covariance="{0}/covariance.csv"),
    "PythonValuesSettings.folder": calibrated(**python("{0}")),
    "PythonSettings.object": {"error_model": python("{0}")},
    "PythonSettings.folder": {
        "true_machine": {"kind": "random", "position": "2 um", "error_model": python("{0}")}
    },
    "ReadingsSettings.files": {"readings": {"files": "{0}/readings.csv"}},
    "SagSettings.values": {"influences": [{"kind": "sag", "values": "{0}/sag.csv"}]},
    "StarSettings.values": {
        "stars": [
            {
                "probes": ["down", "right", "left"],
                "standard_uncertainty": "1 um",
                "values": "{0}/star.csv",
            }
        ]
    },
    "TrueMachineFileSettings.file": {
        "true_machine": {"kind": "machine", "file": "{0}/machine.yaml"}
    },
    "TrueMapSettings.file": {"true_machine": {"kind": "map", "file": "{0}/map.yaml"}},
    # Files that a file in the right folder names.
    "a machine file's table": {"error_model": {"kind": "machine", "file": "machine.yaml"}},
    "a part file's table": {"part": {"file": "part.yaml"}},
    "a part file's machine": {"part": {"file": "random.yaml"}},
    "a map of a machine file": {"true_machine": {"kind": "map", "file": "machine-map.yaml"}},
    "a map in Python": {"true_machine": {"kind": "map", "file": "map.yaml"}},
    "a map as prior": {"priors": [{"kind": "map", "file": "map.yaml"}]},
    # Found where Python looks for modules.
    "an installed module": {"error_model": {"kind": "python", "object": "canary:build"}},
    "/proc/self/cwd": {"error_model": python("/proc/self/cwd")},
}
# Keys with the word that name neither.
OTHERS = {
    "CoefficientSettings.values": "values by name",
    "PricedCoordinatesSettings.values": "CoordinatesSettings, in a pool",
    "PricedCoordinatesSettings.covariance": "CoordinatesSettings, in a pool",
    "PricedDistancesSettings.values": "DistancesSettings, in a pool",
    "PricedDistancesSettings.covariance": "DistancesSettings, in a pool",
    "PricedPythonValuesSettings.object": "PythonValuesSettings, in a pool",
    "PricedPythonValuesSettings.folder": "PythonValuesSettings, in a pool",
    "PricedPythonValuesSettings.values": "PythonValuesSettings, in a pool",
    "PricedPythonValuesSettings.covariance": "PythonValuesSettings, in a pool",
}
CANARY = """
from pathlib import Path

import numpy as np
from ballplate.models import Parameter, Reported

Path({ran!r}).touch()


class Axes:
    dimension = 3
    parameters = (Parameter("scale", "1", "scale", "common scale", 1.0),)

    def jacobian(self, x, a, p):
        return x[:, :, None] + 0.0

    def error(self, x, a, p):
        return self.jacobian(x, a, p) @ a + p

    def reported(self):
        return Reported(("scale",), ("1",), np.eye(1))


def build(*given):
    return Axes()
"""
MACHINE = """title: a machine
arrangement: MB2
volume: [1 m, 1 m, 1 m]
errors: {{EXX: {{file: {0}/exx.csv}}}}
"""
PART = """part: a face
probing: {{point_repeatability: 1 um, tip: {{diameter: 4}}}}
places: {{there: {{origin: [300, 300, 300]}}}}
features: {{top: {{points: {0}, fit: plane, normal: z+}}}}
dimensions: [{{flatness: top}}]
random_part: {1}
"""


def schema_keys() -> set[str]:
    """Keys of the experiment's schema whose description speaks of files or code, with their class."""
    schema = json.loads(Path("designs/schema.json").read_text(encoding="utf-8"))
    return {
        f"{name}.{key}"
        for name, one in schema["$defs"].items()
        for key, said in one.get("properties", {}).items()
        if key in ("file", "files", "values", "covariance", "folder", "object")
    }


def test_every_key_that_names_a_file_is_tried() -> None:
    assert schema_keys() == {key for key in READ if "." in key} | set(OTHERS)


def placed(value: Any, folder: str) -> Any:
    if isinstance(value, dict):
        return {key: placed(item, folder) for key, item in value.items()}
    if isinstance(value, list):
        return [placed(item, folder) for item in value]
    return value.replace("{0}", folder) if isinstance(value, str) else value


def design_of(key: str, folder: str) -> dict[str, Any]:
    sections = {**BASE, "artefacts": {"plate": PLATE}} | placed(READ[key], folder)
    if "calibration" in sections and sections["calibration"] != BASE["calibration"]:
        (one,) = sections["calibration"]
        sections["calibration"] = [{"standard_uncertainty": "0.2 um", **one}]
        if "covariance" in one or one["kind"] == "coordinates":
            del sections["calibration"][0]["standard_uncertainty"]
    return sections


@pytest.fixture(scope="module")
def fitted() -> bp.FittedMap:
    own = bp.experiment({**BASE, "error_model": {"kind": "metric"}}, Path())
    return bp.fit(own, bp.simulate(own)).to_map()


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fitted: bp.FittedMap) -> Path:
    """A folder with files that nobody has opened, beside one with what they must not touch."""
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir(), outside.mkdir()
    for folder in (inside, outside):
        (folder / "canary.py").write_text(CANARY.format(ran=str(tmp_path / "ran")))
    lines = ["ball,x_mm,y_mm"] + [
        f"r{r}c{c},{375 * c - 375},{375 * r - 375}" for r in (1, 2, 3) for c in (1, 2, 3)
    ]
    (outside / "balls.csv").write_text("\n".join(lines) + "\n")
    (outside / "distances.csv").write_text(
        "ball_1,ball_2,distance_mm,standard_uncertainty_um\nr1c1,r1c3,750,0.2\n"
    )
    (outside / "covariance.csv").write_text("covariance_um2,r1c1 r1c3\nr1c1 r1c3,0.04\n")
    (outside / "points.csv").write_text("x_mm,y_mm,z_mm\n100,100,100\n900,900,900\n")
    (outside / "curves.csv").write_text("position_mm,EXX_um\n0,0\n500,1\n1000,0\n")
    (outside / "exx.csv").write_text("position_mm,EXX_um\n0,0\n500,1\n1000,0\n")
    (outside / "sag.csv").write_text("ball,sag_um\nr2c2,1\n")
    (outside / "star.csv").write_text(
        "probe,x_mm,y_mm,z_mm\ndown,0,0,-50\nright,50,0,0\nleft,-50,0,0\n"
    )
    (outside / "readings.csv").write_text("position,ball,probe,x_mm,y_mm,z_mm\n")
    (outside / "machine.yaml").write_text(MACHINE.format("."))
    (inside / "machine.yaml").write_text(MACHINE.format("../outside"))
    (outside / "face.csv").write_text("x_mm,y_mm,z_mm\n0,0,9\n50,0,9\n0,50,9\n50,50,9\n")
    listed = "[[0, 0, 9], [50, 0, 9], [0, 50, 9]]"
    (outside / "part.yaml").write_text(PART.format("face.csv", "machine.yaml"))
    (inside / "part.yaml").write_text(PART.format("../outside/face.csv", "null"))
    (inside / "random.yaml").write_text(PART.format(listed, "../outside/machine.yaml"))
    monkeypatch.chdir(inside)
    monkeypatch.setattr(sys, "path", [*sys.path, str(outside)])
    for name in [name for name in sys.modules if name == "canary"]:
        monkeypatch.delitem(sys.modules, name)
    # Maps of an error model that is then exchanged for one that must not be run, or read.
    bp.write_map(fitted, inside / "plain.yaml")
    text = (inside / "plain.yaml").read_text()
    for name, settings in (
        ("map.yaml", python(".")),
        ("machine-map.yaml", {"kind": "machine", "file": "../outside/machine.yaml"}),
    ):
        for folder in (inside, outside):
            changed = re.sub(r"(?m)^error_model: .*$", f"error_model: {json.dumps(settings)}", text)
            (folder / name).write_text(re.sub(r"(?m)^(checksum|files):.*\n(- .*\n)*", "", changed))
    return inside


def checked(folder: Path, sections: dict[str, Any], *options: str) -> None:
    (folder / "design.yaml").write_text(json.dumps(sections))
    assert main(["check", "--no-modules", *options, "design.yaml"]) == (
        0 if "files" in sections.get("readings", {}) else 3
    )


def looked_at(folder: Path, sections: dict[str, Any]) -> None:
    """A design that is chosen from the list of the studio, which was opened for another one."""
    (folder / "first.yaml").write_text(json.dumps(BASE))
    (folder / "other.yaml").write_text(json.dumps(sections))
    session = Session(folder / "first.yaml")
    session.act({"do": "open", "name": "other.yaml"})
    session.state()
    document = session._document
    for name, job in JOBS.items():
        work = {"axes": [{"paths": ["title"], "values": ["x"]}], "name": "", "content": ""}
        if name in ("suggest", "next", "sweep", "monte carlo"):
            with suppress(bp.ExperimentError, ValueError, RuntimeError):
                job(document, work | {"trials": 2}, lambda step: None)
    session.close()


DOORS: dict[str, Callable[[Path, dict[str, Any]], None]] = {
    "check": checked,
    "check --suggest": lambda folder, sections: checked(folder, sections, "--suggest"),
    "studio": looked_at,
}


IN_PYTHON = [key for key in READ if re.search("[Pp]ython|module|folder", key)]
# Repairs read the same files as the plain check, and the studio's user has chosen the file: it may read others.
TRIED = [(door, key) for door in DOORS for key in (READ if door == "check" else IN_PYTHON)]


@pytest.mark.parametrize(("door", "key"), TRIED)
def test_nothing_runs_and_nothing_outside_is_read(
    door: str, key: str, house: Path, watched: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    DOORS[door](house, design_of(key, "../outside"))
    assert not (house.parent / "ran").exists()
    outside = str((house.parent / "outside").resolve())
    if door != "studio":
        assert not [name for name in watched if str(Path(name).resolve()).startswith(outside)]


@pytest.mark.parametrize("key", READ)
def test_the_canary_sings(key: str, house: Path, watched: list[str]) -> None:
    """The test above can fail: a file that was opened by its name runs and reads what it names."""
    if key == "ReadingsSettings.files":
        # A fit alone reads them.
        return
    (house / "design.yaml").write_text(json.dumps(design_of(key, "../outside")))
    main(["check", "design.yaml"])
    has_run = (house.parent / "ran").exists()
    outside = str((house.parent / "outside").resolve())
    assert has_run or any(str(Path(name).resolve()).startswith(outside) for name in watched)
