"""What qualifies a prediction stands in every output that has its figures or verdicts, and only there
where it qualifies.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
import yaml
from ballplate.cli import main
from ballplate.extensions.studio.document import DesignDocument
from ballplate.extensions.studio.judging import VIEWS
from ballplate.simulator.computing import unreported

from tests.reference.small_quickstart import small_sections

# With next to nothing assumed; readings of the clean machine fit it.
ASSUMED = {"tips": "1 nm", "common": "1 nm", "temperature": "1 mK", "sag": "1 nm"}
ASSUMED |= {"drift": "1 nm/h", "scatter": 1.01}
TINY = {"kind": "random", "position": "1 nm", "rotation": "1 nrad", "seed": 2}
BASE: dict[str, Any] = {"assumptions": ASSUMED, "true_machine": TINY, "target_uncertainty": "5 um"}
# In an output: what must be there with the qualification, and must not be without.
WORDS = {
    "scale": "exact probe offsets as scale|scale rests on probe offsets",
    "assumption": "otherwise U6 is|[gG]iven [^:\n]*temperatures exactly known|done,,[^\n]*temperat",
    "undetermined": "rank deficiency [1-9]|Rank deficiency <data|undetermined direction",
    "map": "in the fit of the map|map.json in spite of its fit",
    "reach": "out of reach of probe|the reach of the probes",
}


def sections(kind: str | None, folder: Path) -> dict[str, Any]:
    """The example with one qualification, or with none."""
    written = small_sections(8, 1, **BASE)
    if kind == "scale":
        written["calibration"][0]["standard_uncertainty"] = "2 mm"
    elif kind == "assumption":
        written["assumptions"] = ASSUMED | {"temperature": "1 K"}
    elif kind == "undetermined":
        # Poses and machine of two positions alone.
        written["positions"] = written["positions"][:3]
        written["expected_rank_deficiency"] = 5
    elif kind == "map":
        written["priors"] = [{"kind": "map", "file": "map.json"}]
        experiment = bp.experiment(small_sections(8, 1, **BASE))
        readings = bp.simulate(experiment.with_({"machine.repeatability": "1 um"}), seed=1)
        fitted = bp.fit(experiment, readings)
        bp.write_map(fitted.to_map(), folder / "map.json")
    written["pool"] = pool(kind == "reach")
    return written


def pool(is_short: bool) -> dict[str, Any]:
    group: dict[str, Any] = {"name": "more", "artefact": "plate", "planes": ["z"]}
    group |= {"levels": ["450 mm"], "corners": {"x": ["0 mm", "250 mm"], "y": ["0 mm"]}}
    group |= {"probes": ["down"], "quarter_turns": [0]}
    limits = {"reach": {"down": {"z": ["0 mm", "760 mm"]}}} if is_short else {}
    group["levels"] += ["800 mm"] * is_short
    return {"candidates": [group], "limits": {"keep": [], **limits}}


def said(*command: object) -> Callable[[Path, pytest.CaptureFixture[str]], str]:
    def run(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
        capsys.readouterr()
        status = main([str(word).replace("FILE", str(path)) for word in command])
        assert status in (0, 1), capsys.readouterr().err
        return capsys.readouterr().out

    return run


def of_python(path: Path, _: pytest.CaptureFixture[str]) -> str:
    prediction = bp.run(path)
    assert all(one.text and one.given for one in prediction.qualifications)
    return repr(prediction)


def page(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    said("run", path, "--report", path.with_suffix(".html"), "--force", "-q")(path, capsys)
    text = path.with_suffix(".html").read_text(encoding="utf-8")
    return re.sub(r"<script.*?</script>", "", text.replace("&#39;", "'"), flags=re.DOTALL)


def swept(*end: str) -> Callable[[Path, pytest.CaptureFixture[str]], str]:
    def run(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
        axes = {"seed": {"path": "seed", "values": [1, 2]}}
        sweep = {"title": "two", "base": path.name, "axes": axes, "record": ["U6"]}
        file = path.with_name("sweep.yaml")
        file.write_text(yaml.safe_dump(sweep), encoding="utf-8")
        store = file.with_suffix(".sqlite")
        if not store.exists():
            said("sweep", file, "--workers", 1, "-q")(path, capsys)
        target = path.with_name("out.html" if end[0] == "--report" and len(end) == 1 else "-")
        name = "-" if target.name == "-" else str(target)
        extra = ["--force"] if name != "-" else []
        out = said("sweep", *end[:1], store, *end[1:], "-o", name, *extra)(path, capsys)
        return out if name == "-" else target.read_text(encoding="utf-8")

    return run


def next_of(*end: str) -> Callable[[Path, pytest.CaptureFixture[str]], str]:
    def run(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
        written = yaml.safe_load(path.read_text(encoding="utf-8"))
        written.pop("pool")
        path.write_text(yaml.safe_dump(written), encoding="utf-8")
        table = path.with_suffix(".csv")
        bp.simulate(path).to_csv(table, index=False)
        return said("next", path, table, *end)(path, capsys)

    return run


def later(path: Path, _: pytest.CaptureFixture[str]) -> str:
    document = DesignDocument(path, None, path.read_text(encoding="utf-8"), None)
    view = VIEWS["later"](document, {}, unreported)
    view["assumptions"] = view["assumptions"] and view["assumptions"]["warning"]
    return json.dumps(view, default=str)


GOAL = ("--goal", "U6 maximum 9 um")
FACES: dict[str, Callable[[Path, pytest.CaptureFixture[str]], str]] = {
    "check": said("check", "FILE"),
    "check --json": said("check", "FILE", "--json"),
    "check --goal": said("check", "FILE", *GOAL),
    "github": said("check", "FILE", "--format", "github"),
    "junit": said("check", "FILE", "--format", "junit"),
    "suggest": said("check", "FILE", "--suggest"),
    "run": said("run", "FILE"),
    "run --json": said("run", "FILE", "--json"),
    "page": page,
    "Python": of_python,
    "plan": said("plan", "FILE", "--positions", 7, "--workers", 1, "-q"),
    "plan --json": said("plan", "FILE", "--positions", 7, "--workers", 1, "-q", "--json"),
    "reach": said("reach", "FILE", "--by", "repeatability", *GOAL),
    "reach --json": said("reach", "FILE", "--by", "repeatability", "--json", *GOAL),
    "sweep text": swept("--report", "--format", "text"),
    "sweep page": swept("--report"),
    "sweep CSV": swept("--export"),
    "next": next_of(),
    "next --json": next_of("--json"),
    "studio": later,
}
# Outputs that have no figures of a plan from the pool, or that a deficient design does not have.
CANNOT = {("reach", face) for face in FACES if not face.startswith("plan")}
CANNOT |= {("undetermined", "plan"), ("undetermined", "plan --json")}
EVERY = [(kind, face) for kind in WORDS for face in FACES if (kind, face) not in CANNOT]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str | None], str]:
    texts: dict[str | None, tuple[str, Path]] = {}

    def of(kind: str | None) -> tuple[str, Path]:
        if kind not in texts:
            folder = tmp_path_factory.mktemp(str(kind))
            texts[kind] = yaml.safe_dump(sections(kind, folder), sort_keys=False), folder
        return texts[kind]

    return of


def output(
    kind: str | None, face: str, files: Any, folder: Path, capsys: pytest.CaptureFixture[str]
) -> str:
    text, made = files(kind)
    for file in made.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    path = folder / "plate.yaml"
    path.write_text(text, encoding="utf-8")
    return FACES[face](path, capsys)


@pytest.mark.parametrize("face", FACES)
def test_without_qualifications(
    face: str, files: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = output(None, face, files, tmp_path, capsys)
    assert out.strip()
    for kind, words in WORDS.items():
        assert not re.search(words, out), (kind, out)


@pytest.mark.parametrize(("kind", "face"), EVERY)
def test_every_output_states_it(
    kind: str, face: str, files: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert re.search(WORDS[kind], output(kind, face, files, tmp_path, capsys))
