"""Positions that stay in the file and are not read, and files that are read with their faults."""

from __future__ import annotations

import csv
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.designs import shipped
from ballplate.simulator.experiment import lay_out, load
from ballplate.simulator.inputs import ExperimentError

QUICKSTART = Path(shipped("quickstart.yaml"))
TEXT = QUICKSTART.read_text(encoding="utf-8")
LINE = next(line for line in TEXT.splitlines(keepends=True) if "name: z high" in line)
OFF = TEXT.replace("name: z high,", "name: z high, enabled: false,")
# A level at which all balls are above the volume.
OUTSIDE = TEXT.replace(LINE, LINE.replace("80 %", "7500 mm"))


def experiment_of(text: str, **options: bool) -> bp.Experiment:
    (experiment,) = load(QUICKSTART, text=text, **options)
    return experiment


def test_one_that_is_off_counts_as_one_that_is_gone() -> None:
    off, gone = experiment_of(OFF), experiment_of(TEXT.replace(LINE, ""))
    assert off.switched_off == ("z high",) and gone.switched_off == ()
    first, second = bp.run(off), bp.run(gone)
    assert first.verdict.observations == second.verdict.observations
    for symbol, quantity in first.quantities.items():
        assert quantity.average == second.quantities[symbol].average, symbol


def test_it_may_leave_the_volume_but_not_the_language_of_the_file() -> None:
    assert experiment_of(
        OUTSIDE.replace("name: z high,", "name: z high, enabled: false,")
    ).switched_off
    with pytest.raises(ExperimentError, match="quarter_turns"):
        experiment_of(OFF.replace("quarter_turns: 1", "quarter_turns: 7"))


def test_other_sections_may_name_it() -> None:
    """Priors and temperatures of it are about nothing, and nothing is wrong with them."""
    section = """
priors:
  - {parameter: "z high: origin x", standard_uncertainty: 1 um}
influences:
  - {kind: position scale, positions: [z low, z high], standard_uncertainty: 1 ppm}
"""
    on, off = experiment_of(TEXT + section), experiment_of(OFF + section)
    assert len(on.priors) == 1 and off.priors == ()
    assert len(lay_out(off).influence_parameters) == len(lay_out(on).influence_parameters) - 1


def test_some_position_has_to_be_on() -> None:
    names = [place.name for place in experiment_of(TEXT).positions]
    every = TEXT
    for name in names:
        every = every.replace(f"name: {name},", f"name: {name}, enabled: false,")
    with pytest.raises(ExperimentError, match="all are switched off"):
        experiment_of(every)


def test_an_artefact_goes_with_its_only_position() -> None:
    bar = """artefacts:
  bar: {kind: two_spheres, length: 500 mm}
"""
    position = """positions:
  - name: on bar
    artefact: bar
    enabled: false
    pose: {origin: [500 mm, 500 mm, 500 mm]}
    probes: [down]
"""
    text = TEXT.replace("artefacts:\n", bar).replace("positions:\n", position)
    text = text.replace("- kind: distances\n", "- kind: distances\n    artefact: plate\n")
    text = text.replace(", plane: ", ", artefact: plate, plane: ")
    assert list(experiment_of(text).artefacts) == ["plate"]
    assert list(experiment_of(text.replace("    enabled: false\n", "")).artefacts) != ["plate"]


def test_readings_of_it_are_left_out_and_counted(tmp_path: Path) -> None:
    table = tmp_path / "readings.csv"
    readings = bp.simulate(bp.load(QUICKSTART))
    readings.to_csv(table, index=False)
    off, gone = tmp_path / "off.yaml", tmp_path / "gone.yaml"
    off.write_text(OFF)
    gone.write_text(TEXT.replace(LINE, ""))
    with table.open() as lines:
        rows = list(csv.reader(lines))
    kept = tmp_path / "kept.csv"
    with kept.open("w", newline="") as lines:
        csv.writer(lines).writerows(row for row in rows if row[0] != "z high")
    fits = [bp.fit(off, table), bp.fit(gone, kept)]
    count = sum(row[0] == "z high" for row in rows)
    assert any("switched off" in note and str(count) in note for note in fits[0].observed.remarks)
    estimates = [fit.quantities["U6"].average for fit in fits]
    assert estimates[0] == estimates[1]


def test_a_tolerant_reader_gets_everything_with_its_faults() -> None:
    names = [place.name for place in experiment_of(TEXT).positions]
    for text in (OFF, OUTSIDE):
        found = experiment_of(text, tolerant=True)
        assert [place.name for place in found.positions] == names
    (fault,) = found.faults
    assert fault.path == "positions[1]" and "moves the scales" in fault.text
    with pytest.raises(ExperimentError, match="moves the scales"):
        lay_out(found)
    # A position that cannot be understood is told of, and the others are there.
    unclear = experiment_of(
        TEXT.replace("plane: z, level: 80", "plane: q, level: 80"), tolerant=True
    )
    assert len(unclear.positions) == len(names) - 1 and unclear.faults
    # What is no experiment at all is refused.
    with pytest.raises(ExperimentError):
        experiment_of(TEXT.replace("machine:", "machines:"), tolerant=True)
