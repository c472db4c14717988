"""Pages of ten kinds of designs, of their fits and of sweeps over them, in a browser at the width
of a phone, a tablet and a desk: nothing stands outside, no label is cut, nothing is asked for.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
from ballplate.extensions.pages.design_contents import page_of_design
from ballplate.extensions.sweeps.task import CellResult
from ballplate.simulator.inputs.yamltree import to_python

from tests.extensions.pages.browser import assert_quiet, browser, program
from tests.extensions.pages.test_page_in_browser import CUT, OUTSIDE
from tests.extensions.pages.test_result_pages import CHANGED, FOUR, small
from tests.extensions.sweeps.stores import axis, done, failed, made_up

CHROMIUM = program()

pytestmark = [
    pytest.mark.browser,
    pytest.mark.long,
    pytest.mark.skipif(
        CHROMIUM is None,
        reason="no Chromium on this machine; install it, or name it in BALLPLATE_CHROMIUM",
    ),
]

LONG = "x high " + 4 * "averylongnamewithoutanyspaces"
NAMES = ("z <low> & \"a\" 'b'", "</script><img src=x onerror=alert(1)>", "=cmd|' /C calc'!A0", LONG)
TEMPERATURE = {
    "kind": "temperature",
    "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "0.6 um/m/K"},
    "artefact_temperature": {"value": "21.5 degC", "standard_uncertainty": "50 mK"},
    "scale_expansion": {"value": "8 um/m/K", "standard_uncertainty": "0.3 um/m/K"},
    "scale_temperature": {"value": "20.8 degC", "standard_uncertainty": "50 mK"},
}
GRID = {"kind": "grid", "balls": [3, 3], "size": ["300 mm", "300 mm"]}


def thirty() -> list[dict[str, Any]]:
    """Positions across all axes."""
    found = []
    for k in range(30):
        plane = "zxy"[k % 3]
        axes = {"z": "xy", "x": "yz", "y": "zx"}[plane]
        found.append(
            {
                "name": f"position number {k + 1} of the whole campaign",
                "plane": plane,
                "level": f"{100 + 37 * k % 800} mm",
                "corner": {axis: f"{(53 * k + 17 * j) % 250} mm" for j, axis in enumerate(axes)},
                "quarter_turns": k % 4,
                "probes": {"z": ["down"], "x": ["right", "left"], "y": ["back", "front"]}[plane],
            }
        )
    return found


def plates() -> dict[str, Any]:
    """Two plates and a length bar."""
    positions = [{**one, "probes": ["down", "right"]} for one in thirty()[:6]]
    for k, one in enumerate(positions):
        one |= {"artefact": ("plate", "small plate")[k % 2], "corner": _at(one["plane"], "200 mm")}
    bar = {"origin": ["200 mm", "500 mm", "500 mm"], "rotation": ["0 deg", "0 deg", "0 deg"]}
    positions.append({"name": "bar", "artefact": "bar", "pose": bar, "probes": ["down"]})
    artefacts = {"plate": {**GRID, "size": ["500 mm", "500 mm"]}, "small plate": GRID}
    artefacts["bar"] = {"kind": "two_spheres", "length": "550 mm", "role": "length_standard"}
    certificate = {"kind": "distances", "artefact": "bar", "pairs": "all"}
    return {
        "artefacts": artefacts,
        "positions": positions,
        "calibration": [{**certificate, "standard_uncertainty": "0.5 um"}],
    }


def _at(plane: str, where: str) -> dict[str, str]:
    return {axis: where for axis in "xyz" if axis != plane}


def designs() -> dict[str, Any]:
    """What is changed of a small experiment, or the file of another one."""
    named = [{**one, "name": name} for one, name in zip(FOUR, NAMES, strict=True)]
    hostile = {"title": f"a <i>title</i> & {90 * 'W'}", "description": "<u>one</u>\n& two"}
    hostile["positions"] = [{**one, "probes": ["down"]} for one in named]
    hostile["artefacts"] = {"<b>&amp; plate": {**GRID, "size": ["500 mm", "500 mm"]}}
    hostile["probes"] = {"down": ["0 mm", "0 mm", "0 mm"]}
    return {
        "quickstart": "designs/quickstart.yaml",
        "deficient": CHANGED["deficient"],
        "plane": "designs/certified/two-dimensions.yaml",
        "plates": plates(),
        "star": {"stars": [{"standard_uncertainty": "0.2 um"}]},
        "length standards": "designs/certified/bars-in-a-plane.yaml",
        "influences": {"influences": [TEMPERATURE]},
        "own model": "own",
        "thirty positions": {"positions": thirty()},
        "hostile names": hostile,
    }


@pytest.mark.parametrize("name", designs())
def test_pages_open_alone_at_all_widths(name: str, tmp_path: Path) -> None:
    assert CHROMIUM is not None
    chosen = designs()[name]
    if chosen == "own":
        code = Path("docs/how-to/own-error-model.md").read_text(encoding="utf-8")
        source = code.split("```{file} straight.py\n")[1].split("```")[0]
        (tmp_path / "straight.py").write_text(source, encoding="utf-8")
        chosen = {"error_model": {"kind": "python", "object": "straight:build"}}
        chosen["true_machine"] = None
        tree = to_python(bp.quickstart().tree)
        written = {key: one for key, one in (tree | chosen).items() if one is not None}
    elif isinstance(chosen, str):
        written = to_python(bp.load(chosen).tree)
    else:
        written = to_python(small(**chosen).tree)
    file = tmp_path / "design.yaml"
    file.write_text(json.dumps(written), encoding="utf-8")
    experiment = bp.load(file)
    sweep = {"title": f"sweep of {name}", "base": "design.yaml", "record": ["U5", "U6"]}
    sweep["axes"] = {"seed": {"path": "seed", "values": [1, 2]}}
    steps = {"path": "machine.repeatability", "values": ["0.1 um", "0.2 um", "0.4 um"]}
    sweep["axes"]["repeatability"] = steps
    (tmp_path / "sweep.yaml").write_text(json.dumps(sweep), encoding="utf-8")
    bp.sweep(tmp_path / "sweep.yaml")
    pages = {
        "design": page_of_design(experiment, bp.run(experiment)),
        "fit": bp.fit(experiment, bp.simulate(experiment, seed=1)).page(),
        "sweep": bp.page(bp.stored(tmp_path / "sweep.sqlite")),
    }
    with browser(CHROMIUM, tmp_path) as tab:
        for kind, text in pages.items():
            path = tmp_path / f"{kind}.html"
            path.write_text(text, encoding="utf-8")
            for width in (400, 900, 1400):
                tab.resize(width)
                tab.open(path)
                assert tab.value(OUTSIDE) == [], (kind, width)
                assert tab.value(CUT) == [], (kind, width)
        assert_quiet(tab)


def test_a_page_of_a_hundred_thousand_settings_is_light(tmp_path: Path) -> None:
    assert CHROMIUM is not None
    numbers = [[float(k + 1) for k in range(count)] for count in (100, 50, 20)]
    axes = [
        axis(name, [f"{one:g}" for one in values], values, "1")
        for name, values in zip(("size", "level", "balls"), numbers, strict=True)
    ]

    def rows() -> Iterator[CellResult]:
        for k, (size, level, balls) in enumerate(product(*numbers)):
            if k % 997 == 0:
                yield failed(k, f"cell {k} is outside of the volume")
                continue
            average = 1e-6 * (1.0 + level) / (size * balls)
            open_ = float(k % 13 == 0)
            yield done(
                k,
                {
                    "U6_average_m": average,
                    "U6_maximum_m": 2.0 * average,
                    "U6_undetermined": open_,
                    "U6_within_target": 1.0 if average < 1e-8 and not open_ else 0.5,
                    "rank_deficiency": open_,
                    "as_expected": 1.0,
                    "observations": 100.0 * balls,
                },
            )

    made_up(tmp_path / "many.sqlite", "many settings", axes, rows()).close()
    text = bp.page(bp.stored(tmp_path / "many.sqlite"))
    assert len(text) < 1e6
    path = tmp_path / "many.html"
    path.write_text(text, encoding="utf-8")
    with browser(CHROMIUM, tmp_path) as tab:
        tab.open(path)
        assert tab.value("document.querySelectorAll('*').length") < 15_000
        assert "of 99899 cases meet" in tab.value("document.querySelector('.verdict').innerText")
        assert_quiet(tab)
