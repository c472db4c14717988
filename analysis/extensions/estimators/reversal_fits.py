"""Reversal of NBSIR 79-1752, with the full estimate of the same readings.

The full estimate is the report's multiple redundancy: all co-ordinates of the plate, one pose, and
the two-dimensional metric as the machine's error model. It needs no approximation and has standard
uncertainties.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from ballplate.results import Fit, ParameterEstimate, axes_of_plates, fit, in_plate_axes
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design, SharedLayout, State, reading_noise
from ballplate.simulator.estimation import estimate
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import rotation_from_vector, vector_from_rotation
from ballplate.simulator.inputs import ExperimentError, Message, Steps, listing
from ballplate.simulator.machines import Array, Integers, MetricSettings, Scale, build_error_model
from ballplate.simulator.readings import ObservedReadings
from numpy.typing import NDArray

from .reversal import Reversal, UndeterminedError, reverse, turn_between
from .reversal_result import ReversalFit, of_all_balls

INSTEAD = "or fit without --estimator, which takes any positions"


@single_threaded
def fit_reversal(
    experiment: Experiment,
    observed: ObservedReadings,
    scale: Scale | None = None,
    offsets: bool = True,
    sigma: Literal["estimated", "given"] | None = None,
) -> ReversalFit:
    """Estimate squareness, scale difference and the plate from two positions a quarter turn
    apart.

    `scale` overrides the file's axis of the scale difference, `sigma` its treatment of
    uncertainties.

    :raises ExperimentError: the experiment is no reversal; every reason at once.
    """
    _refuse_others(experiment, observed, scale)
    settings: MetricSettings = experiment.error_model
    scale = settings.plane_scale if scale is None else scale
    experiment = replace(experiment, error_model=settings.model_copy(update={"scale": scale}))
    corners = experiment.machine.volume.corners
    design = replace(observed.design, model=build_error_model(experiment.error_model, *corners))
    observed = replace(observed, design=design)
    common_balls = _in_both(observed)
    means = _mean_readings(observed)[:, common_balls]
    k, m = (0, 1) if turn_between(*means) < 0.0 else (1, 0)
    try:
        reversal = reverse(means[k], means[m], scale, offsets)
        p_value = (
            float("nan") if offsets else _p_value(reversal, reverse(means[k], means[m], scale))
        )
    except UndeterminedError as error:
        text = f"{error}; read balls that are not"
        raise experiment.refused(("artefacts", design.artefacts.names[0]), text) from None
    axes = axes_of_plates(experiment)[design.artefacts.names[0]]
    full = fit(experiment, observed, sigma)
    values = [reversal.alpha, reversal.beta, reversal.gamma, *reversal.offset.tolist()][
        : 5 if offsets else 3
    ]
    uncertainties = reversal.spread * _of_difference(experiment, observed, reversal, sigma)
    return ReversalFit(
        experiment.label,
        experiment.title,
        scale,
        offsets,
        design.positions.names[k],
        design.positions.names[m],
        means[k] + design.positions.origins[k],
        reversal,
        tuple(
            ParameterEstimate(name, value, u, unit)
            for (name, unit), value, u in zip(
                PARAMETERS, values, uncertainties.tolist(), strict=False
            )
        ),
        axes,
        design.balls.names,
        common_balls,
        in_plate_axes(
            of_all_balls(reversal.coordinates, common_balls, len(design.balls.names)), axes
        )[0],
        full,
        _redundant(design, full, k, m) if full.converged else (),
        p_value,
    )


def reversal_beside_full(
    experiment: Experiment, observed: ObservedReadings
) -> tuple[Array, Array] | None:
    """Return the machine's parameters by the full estimator and by the reversal; None if either
    fails.

    :raises ExperimentError: the experiment is no reversal; every reason at once.
    """
    _refuse_others(experiment, observed, None)
    full = estimate(observed.design, observed.x)
    means = _mean_readings(observed)[:, _in_both(observed)]
    first, second = means if turn_between(*means) < 0.0 else means[::-1]
    scale = experiment.error_model.plane_scale
    try:
        reversal = reverse(first, second, scale)
    except UndeterminedError:
        return None
    if full.status != "converged":
        return None
    return full.state.a, np.array([reversal.alpha, reversal.gamma][: 1 if scale == "none" else 2])


PARAMETERS: tuple[tuple[str, Literal["rad", "1", "m"]], ...] = (
    ("alpha", "rad"),
    ("beta", "rad"),
    ("gamma", "1"),
    ("offset x", "m"),
    ("offset y", "m"),
)


def _refuse_others(experiment: Experiment, observed: ObservedReadings, scale: Scale | None) -> None:
    """Refuse experiments that are no reversal."""
    messages = []

    def add(steps: Steps, text: str) -> None:
        messages.append(experiment.message(steps, f"{text}, {INSTEAD}"))

    if not isinstance(experiment.error_model, MetricSettings):
        kind = experiment.error_model.kind
        text = 'the reversal needs a machine of kind "metric" in two dimensions'
        solid = experiment.dimension == 3
        remedy = "write metric" + (
            " and leave z out of the volume and of all points" if solid else ""
        )
        add(
            ("error_model", "kind"), f'{text}, not "{kind}"{" in three" if solid else ""}; {remedy}'
        )
    elif experiment.dimension != 2:
        add(("machine", "volume"), "the reversal needs two dimensions, not three; leave z out")
    elif scale not in (None, experiment.error_model.plane_scale) and experiment.priors:
        add(
            ("priors",),
            f"priors refer to the file's error model; write scale: {scale} there instead of"
            " --scale",
        )
    if len(experiment.artefacts) != 1:
        names = listing(experiment.artefacts)
        add(
            ("artefacts",),
            f"the reversal takes one artefact, not {len(experiment.artefacts)} ({names}); keep one",
        )
    if len(experiment.positions) != 2:
        text = (
            "the reversal takes two positions, a quarter turn apart, not"
            f" {len(experiment.positions)}"
        )
        add(("positions",), f"{text}; keep two")
    elif not messages:
        messages += _unusable_readings(experiment, observed)
        if not messages:
            _refuse_turn(observed, add)
    if messages:
        raise ExperimentError(messages)


def _unusable_readings(experiment: Experiment, observed: ObservedReadings) -> list[Message]:
    """Return messages about readings with several probes, or without the balls of the plate's
    axes.
    """
    design = observed.design
    file = observed.marks[0].file if observed.marks else str(experiment.source)
    messages = []
    probes = [design.probes.names[probe] for probe in np.unique(design.readings.probe)]
    if len(probes) > 1:
        text = (
            f"the reversal takes readings with one probe, not with {listing(probes)}; keep those"
            f" with one, {INSTEAD}"
        )
        messages.append(Message(file, 0, 0, "", text))
    count = np.zeros((2, len(design.balls.names)), np.int64)
    np.add.at(count, (design.readings.position, design.readings.ball), 1)
    axes = axes_of_plates(experiment)[design.artefacts.names[0]]
    for k in range(2):
        of_axes = [ball for ball in (axes.origin, axes.ball) if count[k, ball] == 0]
        if of_axes:
            unread = [f'"{design.balls.names[ball]}"' for ball in of_axes]
            text = (
                "the reversal needs the balls that define the plate's axes in both positions; in"
                f' "{design.positions.names[k]}" the readings lack '
            )
            text = f"{text}{listing(unread)}; read them, {INSTEAD}"
            messages.append(Message(file, 0, 0, "", text))
    return messages


def _refuse_turn(observed: ObservedReadings, add: Callable[[Steps, str], None]) -> None:
    """Refuse positions that are not about a quarter turn apart."""
    if len(observed.design.balls.names) < 2:
        return
    common_balls = _in_both(observed)
    if len(common_balls) < 2:
        add(("positions",), "fewer than two balls are read in both positions; read more")
        return
    turn = np.degrees(turn_between(*_mean_readings(observed)[:, common_balls]))
    if not 45.0 < abs(turn) < 135.0:
        names = " and ".join(f'"{name}"' for name in observed.design.positions.names)
        add(
            ("positions",),
            f"a turn of {abs(turn):.4g} degrees lies between {names}; turn the plate by about 90",
        )


def _in_both(observed: ObservedReadings) -> Integers:
    """Return balls that are read in both positions."""
    readings = observed.design.readings
    first, second = (readings.ball[readings.position == k] for k in range(2))
    return np.intersect1d(first, second)


def _of_difference(
    experiment: Experiment,
    observed: ObservedReadings,
    reversal: Reversal,
    sigma: Literal["estimated", "given"] | None,
) -> float:
    """Return the standard deviation of the difference of a ball's two readings: of the residuals,
    or the root mean square of stated ones.
    """
    if (sigma or experiment.sigma) == "estimated" and reversal.degrees_of_freedom > 0:
        return reversal.sigma
    design, readings = observed.design, observed.design.readings
    is_common = np.isin(readings.ball, _in_both(observed))
    variance = np.zeros((2, len(design.balls.names), 2))
    count = np.zeros(variance.shape[:2])
    index = readings.position[is_common], readings.ball[is_common]
    np.add.at(variance, index, reading_noise(design, readings.select(is_common)) ** 2)
    np.add.at(count, index, 1.0)
    of_means = variance[count > 0] / count[count > 0][:, None] ** 2
    return float(np.sqrt(2.0 * of_means.mean()))


def _mean_readings(observed: ObservedReadings) -> Array:
    """Return the mean reading (2, n, 2) of each ball in each position, with its probe's offset,
    from the nominal origin; zero without readings.
    """
    design, readings = observed.design, observed.design.readings
    points = (
        observed.x
        + design.probes.offsets[readings.probe]
        - design.positions.origins[readings.position]
    )
    total = np.zeros((2, len(design.balls.names), 2))
    count = np.zeros(total.shape[:2])
    np.add.at(total, (readings.position, readings.ball), points)
    np.add.at(count, (readings.position, readings.ball), 1.0)
    return total / np.maximum(count, 1.0)[:, :, None]


def _p_value(three: Reversal, five: Reversal) -> float:
    """Return the p-value of an F-test of the offsets: five parameters against three."""
    from scipy.special import fdtrc

    if five.degrees_of_freedom <= 0:
        return 1.0
    squares = five.sigma**2 * five.degrees_of_freedom
    if not squares > 0.0:
        return 0.0
    explained = (three.sigma**2 * three.degrees_of_freedom - squares) / 2.0
    return float(fdtrc(2.0, five.degrees_of_freedom, max(explained, 0.0) / five.sigma**2))


def _redundant(design: Design, full: Fit, k: int, m: int) -> tuple[ParameterEstimate, ...]:
    """Return alpha, beta, gamma and offsets of the full estimate, of the second position `m`
    relative to the first, `k`.
    """
    at = full.functions.at
    layout, state = at.layout, at.state
    unit = np.eye(len(layout))
    # Exact derivatives: an imaginary step has no rounding error in the real part.
    by_shared = [_relation(design, layout, state, k, m, 1e-30j * row).imag / 1e-30 for row in unit]
    rows = np.concatenate([np.transpose(by_shared), unit[layout.model]])
    values = np.concatenate([_relation(design, layout, state, k, m, 0.0 * unit[0]), state.a])
    uncertainties = full.sigma * at.of_shared(rows)
    names = (
        "beta",
        "offset x",
        "offset y",
        *(parameter.name for parameter in design.model.parameters),
    )
    estimates = dict(
        zip(names, zip(values.tolist(), uncertainties.tolist(), strict=True), strict=True)
    )
    return tuple(
        ParameterEstimate(name, *estimates[name], unit)
        for name, unit in PARAMETERS
        if name in estimates
    )


def _relation(
    design: Design, layout: SharedLayout, state: State, k: int, m: int, change: NDArray[Any]
) -> NDArray[Any]:
    """Return beta and the offset (3,) as functions of a `change` of the shared parameters, which
    may be complex.

    Points of the plate are at R y + o, so that readings x of the second position, less its nominal
    origin, are at M x + offset in the first, with M = A R_k R_m^T A^-1.
    """
    poses = np.where(layout.pose_columns >= 0, change[layout.pose_columns], 0.0)
    a = state.a + change[layout.model]
    inverse = (np.eye(2) + design.model.error(np.eye(2, dtype=a.dtype), a, np.zeros((2, 2)))).T
    metric = np.linalg.inv(inverse)
    rotations = rotation_from_vector(poses[:, 2:]) @ state.rotations
    between = rotations[k] @ rotations[m].T
    relation = metric @ between @ inverse
    origins = state.origins + poses[:, :2]
    probe = design.probes.offsets[design.readings.probe[0]]
    # The probe's offset, less the same distorted by the axes' errors.
    shift = probe - metric @ probe
    offset = metric @ (origins[k] - between @ origins[m]) + shift - relation @ shift
    offset = offset - design.positions.origins[k] + relation @ design.positions.origins[m]
    turn = vector_from_rotation((state.rotations[k] @ state.rotations[m].T)[None])[0, 0]
    return np.array([turn - np.pi / 2 + poses[k, 2] - poses[m, 2], *offset])
