"""What an acceptance test will show of a machine that is corrected by a map, by drawing.

An error of a test is that of the map along the length, less that of the calibrated length, plus
the scatter of both touched points. The map's errors of all lengths are drawn from their joint
covariance: they are far from independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.presentation import percent
from ballplate.simulator.computing import TOUCHED, single_threaded, symmetric_root
from ballplate.simulator.design import Flags, Probes, Volume
from ballplate.simulator.estimation import linearise
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.inputs import hint
from ballplate.simulator.machines import Array, ErrorModel

from ..machine_files import FittedMap
from ..maps.correction import map_cautions
from .acceptance_result import Acceptance, acceptance_of
from .acceptance_rules import AGAIN, REPEATS, Agreed, length_plan
from .part_uncertainty import conditions
from .part_values import COVERAGE


@dataclass(frozen=True, eq=False)
class Corrected:
    """A machine corrected by a map, with the index of the `probe` of E0: a square root (n, r) of
    the covariance of the error model's parameters, undetermined directions `null` (n, k), and what
    qualifies its figures.
    """

    label: str
    model: ErrorModel
    volume: Volume
    probes: Probes
    probe: int
    root: Array
    null: Array
    qualified: tuple[str, ...]


def by_design(experiment: Experiment) -> Corrected:
    """Return the machine corrected by the map that an experiment will leave behind."""
    design = lay_out(experiment)
    at, volume, probe = linearise(design), design.machine.volume, design.evaluation.probe
    found = at.shared[at.layout.model], at.shared_null[at.layout.model]
    words = conditions(experiment, at)
    return Corrected(experiment.label, design.model, volume, design.probes, probe, *found, words)


def by_map(fitted: FittedMap) -> Corrected:
    """Return the machine corrected by a fitted map."""
    probes, count = fitted.probes, len(fitted.values)
    found = fitted.root[:count], fitted.undetermined[:count]
    probe = probes.names.index(fitted.probe)
    words = tuple(filter(None, map_cautions(fitted, COVERAGE)))
    return Corrected(fitted.title, fitted.model, fitted.volume, probes, probe, *found, words)


def errors_root(machine: Corrected, ends: Array, probes: Array) -> Array:
    """Return the square root (m, m) of the covariance of errors of lengths between scale readings
    (2, m, d) with probes (m,), in metres.

    :raises ValueError: a length is undetermined.
    """
    # Of a machine without errors, on which offsets of probes move both ends alike.
    none, offsets = np.zeros(len(machine.root)), machine.probes.offsets[probes]
    start, end = (machine.model.jacobian(points, none, offsets) for points in ends)
    along = ends[1] - ends[0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    rows = np.einsum("md,mdn->mn", along, end - start)
    if (np.abs(rows @ machine.null) > TOUCHED).any():
        raise ValueError("lengths of the test are undetermined; complete the campaign first")
    root = rows @ machine.root
    return symmetric_root(root @ root.T)


@single_threaded
def acceptance_prediction(
    machine: Corrected,
    agreed: Agreed,
    probe: str | None = None,
    draws: int = 20_000,
    seed: int = 1,
) -> Acceptance:
    """Return what a test of a corrected machine will show; `probe` names that of E150, which is
    measured across the greater of its offsets x and y from the ram along z.

    :raises ValueError: no such probe, or a length that is undetermined.
    """
    names, of_e150, across = machine.probes.names, machine.probe, -1
    if probe is not None:
        if probe not in names:
            raise ValueError(f'no probe "{probe}"; {hint(probe, names)}')
        of_e150 = names.index(probe)
        aside = np.abs(machine.probes.offsets[of_e150, :2])
        across, told_aside = int(aside.argmax()), f"E150 by {probe}, {1e3 * aside.max():g} mm aside"
        if not aside.any() or len(machine.volume.size) < 3:
            raise ValueError(f"{probe} has no offset across a ram along z; name another probe")
    sets, ends = length_plan(machine.volume, across)
    root = errors_root(machine, ends, np.where(sets.kinds == "E0", machine.probe, of_e150))
    errors = drawn_errors(root, sets.lengths, agreed, draws, seed)
    told = (
        f"{draws} tests drawn, seed {seed}; probe {names[machine.probe]}",
        told_aside if probe else "without E150",
        AGAIN,
        *machine.qualified,
        "errors that the error model does not describe, such as short waves, are left out",
    )
    return acceptance_of(machine.label, agreed, sets, errors, _words, told)


def _words(passes: Flags, again: Flags, fails: Flags) -> str:
    """A share with its standard error, which one more test of either outcome keeps from zero."""
    u = np.append(passes, [True, False]).std() / np.sqrt(len(passes))
    measured_again = f"sets measured again in {percent(again.any(axis=1).mean())}"
    return f"chance to pass {passes.mean():.4f}, standard error {u:.1g}; {measured_again}"


def drawn_errors(root: Array, lengths: Array, agreed: Agreed, draws: int, seed: int) -> Array:
    """Return errors (draws, m, 2, 3) of tests, the first three and the repeated three of each
    length (m,), in metres; `root` (m, m) is of the errors of the map.
    """
    normal = np.random.default_rng(seed).standard_normal
    steady_root = np.vstack([root.T, agreed.gauge.at(lengths)])
    steady = normal((draws, len(steady_root))) @ steady_root
    touched = normal((*steady.shape, 2, REPEATS))
    # Both ends of a length are touched.
    return steady[..., None, None] + np.sqrt(2.0) * agreed.point * touched
