"""A reading's own standard uncertainty: from the experiment file or the CSV to weights, noise and
U1 to U6.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from ballplate.results.fitting import fit
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.readings import reading_weights
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.readings_section import no_settings
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.readings.reading_files import read_readings, write_readings
from ballplate.simulator.readings.simulated import exact_readings, noisy_readings

from tests.reference.small_quickstart import small_quickstart

TEXT = Path("designs/quickstart.yaml").read_text(encoding="utf-8")


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "e.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_groups_of_readings_with_their_own(tmp_path: Path) -> None:
    old = "probes: [right, left]}\n  - {name: x high"
    assert old in TEXT
    groups = (
        "readings: [{probes: [right]}, {probes: [left], standard_uncertainty: [0.1 um, 0.2 um, 0.3"
        " um]}]}"
    )
    design = lay_out(load(written(tmp_path, TEXT.replace(old, groups + "\n  - {name: x high")))[0])
    weights = reading_weights(design, design.readings)
    left = (design.readings.position == 2) & (
        design.readings.probe == list(design.probes.names).index("left")
    )
    np.testing.assert_allclose(weights[left], np.tile([1e7, 5e6, 1 / 3e-7], (25, 1)))
    np.testing.assert_allclose(weights[~left], 5e6)


def test_noise_has_the_stated_size(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        TEXT.replace(
            "probes: [back, front]",
            "standard_uncertainty: [2 um, 0.5 um, 9 um], probes: [back, front]",
        ),
    )
    design = lay_out(load(path)[0])
    state = nominal_state(design)
    readings, x = noisy_readings(design, state, np.random.default_rng(2))
    error = x - exact_readings(design, state)[1]
    rough = readings.position >= 4
    assert error[rough].std(axis=0) == pytest.approx([2e-6, 5e-7, 9e-6], rel=0.25)
    assert error[~rough].std(axis=0) == pytest.approx([2e-7] * 3, rel=0.25)


EXPERIMENT = small_quickstart()
DESIGN = lay_out(EXPERIMENT)


def table(path: Path) -> list[str]:
    """The lines of a table of readings, which a file is for."""
    readings, x = noisy_readings(DESIGN, nominal_state(DESIGN), np.random.default_rng(2))
    with path.open("w", encoding="utf-8") as stream:
        write_readings(stream, DESIGN, readings, x)
    return path.read_text(encoding="utf-8").splitlines()


def test_a_column_for_each_axis(tmp_path: Path) -> None:
    """Weights of single co-ordinates (NPL, equation (11)): those of the readings, and of the fit."""
    path, experiment, design = tmp_path / "r.csv", EXPERIMENT, DESIGN
    header, *rows = table(path)
    u = np.random.default_rng(3).uniform(0.1, 1.0, (len(rows), 3)).round(4)

    def read(names: str, cells: Sequence[Sequence[object]], separator: str = ",") -> Array:
        lines = [f"{header},{names}", *(",".join(map(str, (row, *cell))) for row, cell in zip(rows, cells, strict=True))]  # fmt: skip
        text = "\n".join(lines).replace(",", separator)
        path.write_text(text.replace(".", ",") if separator == ";" else text, encoding="utf-8")
        observed = read_readings(path, design)
        assert observed.design.readings.uncertainty is not None
        return observed.design.readings.uncertainty

    np.testing.assert_allclose(read("u_x_um,u_y_um,u_z_um", u), 1e-6 * u, rtol=1e-12)
    np.testing.assert_allclose(read("u x [µm],u y [µm],u z [µm]", u, ";"), 1e-6 * u, rtol=1e-12)
    nanometres = read("u_z_nm,u_x_nm,u_y_nm", 1e3 * u[:, [2, 0, 1]])
    np.testing.assert_allclose(nanometres, 1e-6 * u, rtol=1e-12)
    # One column for all axes, and one of an axis of its own, which some rows state.
    some = [[0.3, z if k % 2 else ""] for k, z in enumerate(u[:, 2])]
    expected = np.full((len(rows), 3), 0.3)
    expected[1::2, 2] = u[1::2, 2]
    np.testing.assert_allclose(read("u_um,u_z_um", some, ";"), 1e-6 * expected, rtol=1e-12)
    # A co-ordinate that is off weighs nothing if its own uncertainty says so.
    plain = fit(experiment, read_readings(path, design), "given")
    cells = rows[31].split(",")
    rows[31] = ",".join([*cells[:3], str(float(cells[3]) + 1.0), *cells[4:]])
    values = [[*one] for one in expected]
    values[31][0] = 1e6
    read("u_x_um,u_y_um,u_z_um", values)
    unharmed = fit(experiment, read_readings(path, design), "given")
    np.testing.assert_allclose(unharmed.solution.state.a, plain.solution.state.a, rtol=0, atol=2e-6)


@pytest.mark.parametrize(
    ("names", "cell", "message"),
    [
        ("u_x_um,u_y_um,u_z_um", "0.2,0,0.2", "a standard uncertainty must be above zero"),
        ("u_x_um,u_y_um,u_z_um", "0.2,,0.2", "no standard uncertainty, and other"),
        ("U_x_um,U_y_um,U_z_um", "0.2,0.2,0.2", 'unknown column "U_x_um"'),
        ("u_x,u_y_um,u_z_um", "0.2,0.2,0.2", 'unknown unit in the column "u_x"'),
    ],
)
def test_columns_of_axes_that_are_wrong(
    tmp_path: Path, names: str, cell: str, message: str
) -> None:
    path, design = tmp_path / "r.csv", DESIGN
    header, *rows = table(path)
    path.write_text("\n".join([f"{header},{names}", *(f"{row},{cell}" for row in rows)]) + "\n")
    with pytest.raises(ExperimentError, match=message):
        read_readings(path, design)
    path.write_text(path.read_text(encoding="utf-8").replace(",", ";"), encoding="utf-8")
    with pytest.raises(ExperimentError, match="does not say which" if "U_x" in names else "u"):
        read_readings(path, design)
    part = no_settings().model_copy(update={"coordinates": "part"})
    path.write_text("\n".join([f"{header},u_x_um", *(f"{row},1" for row in rows)]) + "\n")
    with pytest.raises(ExperimentError, match="along the machine's axes"):
        read_readings(path, design, settings=part)
