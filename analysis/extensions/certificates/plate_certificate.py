"""Certificate of a plate: co-ordinates of its balls in its own axes with their full covariance."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from ballplate.extensions.influences import TemperaturesSettings
from ballplate.presentation import write_file
from ballplate.results import Fit, plate_axes
from ballplate.simulator.computing import blank, single_threaded
from ballplate.simulator.estimation import MICROMETRE, BallPlaces, Linearisation, displacements
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import BallLayout
from ballplate.simulator.inputs import MOST_NAMES, hint, listing, refused, to_python
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import OWN_SCALES, expansion, pairs_of, scale_of

from ..machine_files import data_of
from .certificate_csv import coordinates_csv, covariance_csv
from .certificate_files import certified_values
from .certificate_page import certificate_page
from .certified_balls import ABOUT, CertifiedBalls, PlateDistance
from .datum import Datum, chosen_datum, in_datum, relative_to
from .digital_form import digital_certificate

# Of so many balls all distances are stated, of more those between corners, or the first ones.
MOST_BALLS_FOR_ALL_DISTANCES = 16
# What is smaller, in metres, is rounding.
ROUNDING = 1e-14


def _tables(certificate: CertifiedBalls, path: Path) -> dict[Path, str]:
    beside = covariance_path(path)
    return {path: coordinates_csv(certificate, beside.name), beside: covariance_csv(certificate)}


# Texts of a certificate by the names of files, by the ending of the name that is given.
FORMS: dict[str, Callable[[CertifiedBalls, Path], dict[Path, str]]] = {
    ".html": lambda certificate, path: {path: certificate_page(certificate)},
    ".csv": _tables,
    ".xml": lambda certificate, path: {path: digital_certificate(certificate)},
}


def covariance_path(path: Path) -> Path:
    """Where the covariance of a table of co-ordinates stands.

    >>> covariance_path(Path("plate.csv")).name
    'plate-covariance.csv'
    """
    return path.with_name(f"{path.stem}-covariance{path.suffix}")


class PlateCertificate(CertifiedBalls):
    """A certificate that can be written."""

    def texts(self, path: str | Path) -> dict[Path, str]:
        """The certificate as the ending of a name says: a page (.html), tables (.csv, with the
        covariance in a second one beside it) or a digital calibration certificate (.xml); by the
        names of files.

        :raises ValueError: another ending, or a digital certificate without what it has to state.
        """
        path = Path(path)
        write = FORMS.get(path.suffix.lower())
        if write is None:
            raise ValueError(
                f'a certificate\'s name ends in {", ".join(FORMS)}, unlike "{path.name}"'
            )
        return write(self, path)

    def save(self, path: str | Path) -> None:
        """Write it, see `texts`.

        :raises OSError: a file cannot be written.
        :raises ValueError: the name has another ending, or a digital certificate lacks something.
        """
        for name, text in self.texts(path).items():
            write_file(name, text.encode())


@single_threaded
def plate_certificate(
    fit: Fit,
    plate: str | None = None,
    datum: Sequence[str] = (),
    coverage_factor: float | None = None,
    about: Mapping[str, str] | None = None,
) -> PlateCertificate:
    """The certificate of a plate from a fit that has converged.

    `datum` names the balls that define the axes, or "all", see `chosen_datum`; `about` has texts
    by the keys of `ABOUT`.

    :raises ExperimentError: the experiment has no such plate; nothing calibrated determines its
        lengths, or nothing its co-ordinates.
    :raises ValueError: the fit has not converged, balls that define no axes, or an unknown key.
    """
    experiment, linearisation = fit.experiment, fit.functions.at
    assert experiment is not None
    if fit.without_scatter:
        raise ValueError(
            "the readings agree exactly with the model and give no estimate of their uncertainty;"
            ' fit with sigma "given"'
        )
    for key in about or {}:
        if key not in ABOUT:
            raise ValueError(f'the certificate has no entry "{key}"; {hint(key, ABOUT)}')
    name = _plate_name(experiment, plate)
    layout = experiment.layouts[name]
    d = experiment.dimension
    if len(layout.names) * d > MOST_NAMES:
        most = MOST_NAMES // d
        text = f"{len(layout.names)} balls are too many for a covariance of all; at most {most}"
        raise refused(experiment.source, text, f"artefacts.{name}")
    axes_stated = plate_axes(layout, experiment.artefacts[name].axes) if d == 2 else None
    chosen = chosen_datum(layout, d, datum, axes_stated)
    index = linearisation.design.balls.of(linearisation.design.artefacts.names.index(name))
    coordinates, root, is_open = _in_axes(linearisation, layout, index, chosen)
    determined = np.flatnonzero(~is_open.any(axis=1))
    if not len(determined) or is_open[_datum_balls(chosen)].any():
        distances = _distances(linearisation, layout, index, np.arange(len(index)), fit.sigma)
        text = _undetermined(is_open, layout, distances)
        raise refused(experiment.source, text, "calibration")
    coordinates, root = coordinates[determined], fit.sigma * root[determined]
    coordinates[np.abs(coordinates) < ROUNDING] = 0.0
    root[np.linalg.norm(root, axis=2) < ROUNDING] = 0.0
    temperature, temperature_text = _temperature(experiment, name)
    carriers = _carriers(experiment, linearisation, name)
    flat = root.reshape(len(determined) * d, -1)
    centred = coordinates - coordinates.mean(axis=0)
    by_scale = np.einsum("nd,ndr->r", centred, root) / (centred**2).sum()
    freedom = float(fit.degrees_of_freedom) if fit.sigma_is_estimated else np.inf
    names = tuple(layout.names[k] for k in determined)
    return PlateCertificate(
        fit.label,
        fit.title,
        name,
        chosen.words(layout.names),
        names,
        coordinates,
        flat @ flat.T,
        _distances(linearisation, layout, index, determined, fit.sigma),
        tuple(layout.names[k] for k in np.flatnonzero(is_open.any(axis=1))),
        carriers,
        float(np.linalg.norm(by_scale)),
        temperature,
        temperature_text,
        coverage_factor or expansion(experiment.coverage_factor),
        freedom,
        _remarks(fit, experiment, name, carriers),
        ABOUT | dict(about or {}),
        _fingerprint(fit, experiment, name, chosen.words(layout.names)),
    )


def _fingerprint(fit: Fit, experiment: Experiment, plate: str, datum: str) -> str:
    """SHA-256 of what a certificate comes from."""
    contents = [
        data_of(fit.observed).sha256,
        to_python(experiment.tree),
        plate,
        datum,
        fit.sigma == 1.0,
    ]
    return hashlib.sha256(json.dumps(contents, default=str, sort_keys=True).encode()).hexdigest()


def _plate_name(experiment: Experiment, plate: str | None) -> str:
    plates = [
        name
        for name, artefact in experiment.artefacts.items()
        if artefact.role == "plate" and len(experiment.layouts[name].names) > 1
    ]
    if plate is None and len(plates) == 1:
        return plates[0]
    if not plates:
        raise refused(experiment.source, "no plate has two balls or more; add one")
    if plate is None:
        raise ValueError(f"the experiment has several plates; choose one of {listing(plates)}")
    if plate not in plates:
        raise ValueError(f'no plate "{plate}"; {hint(plate, plates)}')
    return plate


def _in_axes(
    linearisation: Linearisation, layout: BallLayout, index: Integers, datum: Datum
) -> tuple[Array, Array, Array]:
    """Co-ordinates (n, d) in a datum, a square root (n, d, r) of their covariance, and which of
    them (n, d) are undetermined.
    """
    moved = displacements(linearisation, BallPlaces(index))
    n, d = moved.places.shape
    drawn = layout.coordinates[:, :d]
    rotation_blocks = np.zeros((n, d, n, d))
    rotation_blocks[np.arange(n), :, np.arange(n)] = moved.own
    root = np.concatenate([moved.common, rotation_blocks.reshape(n, d, n * d)], axis=2)
    coordinates, rotation = in_datum(moved.places, datum, drawn)
    root = relative_to(datum, coordinates, np.einsum("ij,njr->nir", rotation, root))
    as_drawn, turn = in_datum(moved.drawn, datum, drawn)
    null = relative_to(datum, as_drawn, np.einsum("ij,njr->nir", turn, moved.null))
    size = np.full((n, d), MICROMETRE)
    return coordinates, root, np.isnan(blank(np.zeros((n, d)), null, size))


def _datum_balls(datum: Datum) -> list[int]:
    if datum.axes is None:
        return []
    datum_balls = [datum.axes.origin, datum.axes.ball]
    return datum_balls if datum.plane is None else [*datum_balls, datum.plane]


def _undetermined(is_open: Array, layout: BallLayout, distances: tuple[PlateDistance, ...]) -> str:
    """Why there is no certificate, as text."""
    if all(np.isnan(distance.standard_uncertainty) for distance in distances):
        return (
            "the readings and the stated values determine no length of the"
            " plate; calibrate a length (ballplate check lists undetermined directions)"
        )
    names = listing(layout.names[k] for k in np.flatnonzero(is_open.any(axis=1)))
    return (
        f"co-ordinates of {names} are undetermined in these axes; choose determined balls for the"
        " datum, or take the missing readings"
    )


def _carriers(experiment: Experiment, linearisation: Linearisation, plate: str) -> tuple[str, ...]:
    """What the plate's lengths rest on, as text.

    :raises ExperimentError: nothing but the machine's own scales.
    """
    scale = scale_of(experiment, linearisation)
    words = [carrier.words for carrier in scale.carriers] if scale is not None else []
    of_machine = words == [OWN_SCALES]
    if of_machine and not certified_values(experiment):
        text = (
            "no calibrated length: the plate's lengths would rest on the machine's own scales,"
            " which are not traceable; add a calibration, or priors of the scales"
        )
        raise refused(experiment.source, text, "calibration")
    # Where the machine's scale is undetermined, it is the plate itself that is calibrated.
    return tuple(words) or (f"certificates of {plate}",)


def _temperature(experiment: Experiment, plate: str) -> tuple[float | None, str]:
    """The temperature that lengths are stated for, None where it is unknown; and as text."""
    for influence in experiment.influences:
        if isinstance(influence, TemperaturesSettings) and influence.artefact in (None, plate):
            if influence.artefact_expansion is not None:
                sentence = (
                    f"lengths are those at {influence.reference:g} °C; the plate's expansion is"
                )
                return influence.reference, f"{sentence} followed from its temperatures"
            sentence = (
                f"the scales' expansion is followed from {influence.reference:g} °C, the plate's is"
            )
            return None, f"reference temperature unknown: {sentence} not"
    return None, (
        "reference temperature unknown: the experiment states no temperatures; lengths are right"
        " where plate, scales and calibrated lengths were at the temperature that these are"
        " stated for"
    )


def _distances(
    linearisation: Linearisation,
    layout: BallLayout,
    index: Integers,
    chosen: Integers,
    sigma: float,
) -> tuple[PlateDistance, ...]:
    """Distances between the `chosen` balls of a layout, whose balls in the design are `index`."""
    moved = displacements(linearisation, BallPlaces(index[chosen]))
    some = np.arange(len(chosen))
    if len(some) > MOST_BALLS_FOR_ALL_DISTANCES:
        corners = np.flatnonzero(np.isin(chosen, layout.corner_set))
        some = corners if len(corners) > 1 else some[:MOST_BALLS_FOR_ALL_DISTANCES]
    pairs = np.array(list(combinations(some, 2)), np.int64).reshape(-1, 2)
    lengths_moved = pairs_of(moved, pairs)
    u = np.where(lengths_moved.is_open, np.nan, sigma * lengths_moved.uncertainties)
    return tuple(
        PlateDistance((layout.names[chosen[i]], layout.names[chosen[j]]), length, uncertainty)
        for (i, j), length, uncertainty in zip(
            pairs.tolist(), lengths_moved.lengths.tolist(), u.tolist(), strict=True
        )
    )


def _remarks(
    fit: Fit, experiment: Experiment, plate: str, carriers: tuple[str, ...]
) -> tuple[str, ...]:
    """What a reader has to know of the fit and of the plate."""
    remarks = [*fit.warnings, *filter(None, [fit.complaint])]
    if carriers == (OWN_SCALES,):
        remarks.append(
            "the error model assumes that the mean of the machine's scales is exact: the"
            " uncertainties do not include its error; a model with a scale for each axis would"
            " take the lengths from the calibrated values"
        )
    flatness = experiment.artefacts[plate].flatness
    if flatness is not None:
        remarks.append(
            "the readings determine no co-ordinate normal to the plate's plane: z is nominal,"
            f" with a standard uncertainty of {1e6 * flatness:.4g} µm for each ball before the"
            " transformation into these axes"
        )
    return tuple(dict.fromkeys(remarks))
