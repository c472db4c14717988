"""Plans weigh lengths that share readings as the full computation does."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.planning.search import value
from ballplate.results.study import predict
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Position
from ballplate.simulator.experiment.pool import with_chosen

from .small_pool import TEXT
from .test_information import problem_of, selections, written

# Bars of four balls and a plate, all of whose distances are certified, in several places each.
STANDARDS = (
    TEXT.replace(
        "bar: {kind: two_spheres, length: 350 mm, role: length_standard}",
        """bar: {kind: balls, role: length_standard, coordinates: {a: [0 mm, 0 mm, 0 mm], b: [80 mm, 0 mm, 0 mm],
    c: [210 mm, 0 mm, 0 mm], d: [350 mm, 0 mm, 0 mm]}}
  tile: {kind: grid, balls: [2, 3], size: [150 mm, 200 mm], role: length_standard}""",
    )
    .replace(
        "  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.5 um}",
        """  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.2 um + L/500000}
  - {kind: distances, artefact: tile, pairs: all, standard_uncertainty: 0.4 um + L/1000000}""",
    )
    .replace(
        "    - {name: bar, artefact: bar, pose: {origin: [100 mm, 250 mm, 200 mm]}, probes: [down],"
        " repeats: 2}",
        """    - {name: bar, artefact: bar, pose: {origin: [100 mm, 250 mm, 200 mm]}, probes: [down], repeats: 2}
    - {name: bar y, artefact: bar, pose: {origin: [100 mm, 100 mm, 200 mm], rotation: [0 deg, 0 deg, 80 deg]},
       probes: [down, right]}
    - {name: tile, artefact: tile, plane: z, level: 100 mm, corner: {x: 100 mm, y: 100 mm}, probes: [down]}
    - {name: tile up, artefact: tile, plane: x, level: 300 mm, corner: {y: 100 mm, z: 100 mm}, probes: [right]}""",
    )
)


@pytest.mark.parametrize("name", ["U6", "U5-maximum"])
def test_equal_to_the_full_computation(name: str, tmp_path: Path) -> None:
    (experiment,) = load(written(tmp_path, STANDARDS), planning=True)
    assert experiment.pool is not None
    problem = problem_of(experiment, name)  # type: ignore[arg-type]
    names = [candidate.name for candidate in experiment.pool.candidates]
    with_standards = 0
    for chosen in selections(experiment, 20, 9, 6):
        items = [experiment.pool.candidates[k] for k in chosen]
        full = predict(with_chosen(experiment, items))
        if full.verdict.deficiency:
            continue
        kind, _, largest = name.partition("-")
        expected = getattr(full.quantities[kind], "maximum" if largest else "average")
        assert value(problem, chosen) == pytest.approx(expected, rel=1e-9), [
            names[k] for k in chosen
        ]
        places = [one.item.artefact for one in items if isinstance(one.item, Position)]
        with_standards += places.count("bar") + places.count("tile") > 1
    assert with_standards > 4


def test_positions_that_read_different_balls_are_not_overrated(tmp_path: Path) -> None:
    """What certificates tell of one another from position to position is left out: a plan is on the
    safe side.
    """
    text = STANDARDS.replace("probes: [down], repeats: 2}", "probes: [down], balls: [a, b, d]}")
    (experiment,) = load(written(tmp_path, text), planning=True)
    assert experiment.pool is not None
    problem = problem_of(experiment, "U6")
    compared = 0
    for chosen in selections(experiment, 20, 10, 6):
        full = predict(with_chosen(experiment, [experiment.pool.candidates[k] for k in chosen]))
        if not full.verdict.deficiency:
            compared += 1
            expected = full.quantities["U6"].average
            assert expected * (1.0 - 1e-9) <= value(problem, chosen) < 1.02 * expected
    assert compared > 4
