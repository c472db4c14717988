"""The assumptions that an experiment makes, each with the entries of the file that drop it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.design import Calibration
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import LengthFunction, child, length_text, listing, to_python

# Thermal expansion of steel, which most plates and scales are compared with.
STEEL = "11.5 um/m/K"

# Correlation of values of one certificate that states no part growing with length.
CORRELATION = 0.9

# Arrangements that differ in which of two axes carries the other.
EXCHANGED = {
    first: second
    for pair in (("MB1", "MB2"), ("FB1", "FB2"), ("FH1", "FH2"), ("MH1", "MH2"), ("CX1", "CY1"))
    for first, second in (pair, pair[::-1])
}

# Entries of the file whose changes add parameters.
ADDING = {"probes", "influences", "error_model"}


@dataclass(frozen=True)
class PredictionAssumption:
    """What an experiment takes for granted, in words, and what may hold `instead`, with its
    `source`.

    `changes` are whole entries of the file, by their keys, that state it. Those of a systematic
    assumption are of the machine that is read; the experiment evaluates its readings unchanged.
    """

    name: str
    assumed: str
    instead: str
    source: str
    changes: Mapping[str, Any]
    is_systematic: bool = False

    @property
    def adds_parameters(self) -> bool:
        """True if the changes only add parameters to those that are estimated."""
        return not self.is_systematic and self.changes.keys() <= ADDING


def assumptions_of(experiment: Experiment) -> list[PredictionAssumption]:
    """Return the assumptions that an experiment makes."""
    stated = _section(experiment, "assumptions") or {}
    found = (find(experiment, stated) for find in _FINDERS)
    return [assumption for assumption in found if assumption is not None]


def _section(experiment: Experiment, key: str) -> Any:
    """Return an entry of the file as it is written, None without it."""
    node = child(experiment.tree, key)
    return None if node is None else to_python(node)


def _tips(experiment: Experiment, stated: Mapping[str, Any]) -> PredictionAssumption | None:
    u = stated.get("tips", "0.5 um")
    in_stars = {name for star in experiment.stars for name in star.probes}
    before = _section(experiment, "probes") or {}
    probes = {}
    for name, value in before.items():
        entry = dict(value) if isinstance(value, Mapping) else {"offset": value}
        is_known_otherwise = {"standard_uncertainty", "unknown", "reference"} & set(entry)
        is_exact = name not in in_stars and not is_known_otherwise
        probes[name] = {**entry, "standard_uncertainty": u} if is_exact else value
    # The first probe is the reference of the others.
    if len(probes) < 2 or probes == before:
        return None
    source = "qualification of styli on a reference sphere"
    return PredictionAssumption(
        "tips", "exact offsets of tips", f"known to {u} each", source, {"probes": probes}
    )


def _certificates(experiment: Experiment, stated: Mapping[str, Any]) -> PredictionAssumption | None:
    items = _section(experiment, "calibration") or []
    changed = []
    used = list(experiment.calibration)
    for entry in items:
        # Items of artefacts that are not placed are not used.
        item = used.pop(0) if used and _is_stated(used[0], entry) else None
        if item is not None and _is_independent(experiment, item):
            changed.append(_with_common(entry, item, stated))
        else:
            changed.append(entry)
    differing = [new for new, old in zip(changed, items, strict=True) if new != old]
    if not differing:
        return None
    parts = sorted(
        {
            f"common part of {new['common']}"
            if "common" in new
            else f"correlation of {new['correlation']:g}"
            for new in differing
        }
    )
    return PredictionAssumption(
        "certificates",
        "independent values of certificates",
        ", ".join(parts),
        "one wavelength, one temperature for all values",
        {"calibration": changed},
    )


def _is_stated(item: Calibration, entry: Mapping[str, Any]) -> bool:
    return item.kind == entry["kind"] and entry.get("artefact", item.artefact) == item.artefact


def _is_independent(experiment: Experiment, item: Calibration) -> bool:
    """Return whether the values of an item of lengths are taken as independent."""
    if item.kind not in ("distances", "coordinates") or item.root is not None or item.size < 2:
        return False
    is_of_plate = experiment.artefacts[item.artefact].role == "plate"
    return is_of_plate and not item.observed(0).is_exact.all()


def _with_common(
    entry: Mapping[str, Any], item: Calibration, stated: Mapping[str, Any]
) -> dict[str, Any]:
    """Return an item with a part that its values have in common: that which grows with length."""
    if "common" in stated:
        return {**entry, "common": stated["common"]}
    uncertainty = getattr(item, "standard_uncertainty", None)
    if isinstance(uncertainty, LengthFunction) and uncertainty.constant and uncertainty.slope:
        return {
            **entry,
            "standard_uncertainty": length_text(uncertainty.constant),
            "common": f"{1e6 * uncertainty.slope!r} um/m",
        }
    return {**entry, "correlation": CORRELATION}


def _unless_stated(
    experiment: Experiment, assumption: tuple[str, str, str, str], *added: dict[str, Any]
) -> PredictionAssumption | None:
    """Return an assumption that further influence quantities drop, None where one of their kind is
    stated; name, assumed, instead and source are given.
    """
    before = _section(experiment, "influences") or []
    kinds = {entry["kind"] for entry in added}
    if not added or any(entry.get("kind") in kinds for entry in before):
        return None
    return PredictionAssumption(*assumption, {"influences": [*before, *added]})


def _temperature(experiment: Experiment, stated: Mapping[str, Any]) -> PredictionAssumption | None:
    u = stated.get("temperature", "0.1 K")
    measured = {"value": "20 degC", "standard_uncertainty": u, "sensor_uncertainty": u}
    expansion = {"value": STEEL, "standard_uncertainty": "0 um/m/K"}
    added = {
        "kind": "temperature",
        "artefact_expansion": expansion,
        "artefact_temperature": measured,
        "scale_expansion": expansion,
        "scale_temperature": measured,
    }
    instead = f"known to {u}, in all positions alike and in each"
    source = "thermometers of a measuring room; both of steel"
    words = ("temperature", "temperatures exactly known", instead, source)
    return _unless_stated(experiment, words, added)


def _sag(experiment: Experiment, stated: Mapping[str, Any]) -> PredictionAssumption | None:
    plates = [name for name, entry in experiment.artefacts.items() if entry.role == "plate"]
    u = {name: stated.get("sag") or _usual_sag(experiment, name) for name in plates}
    added = [{"kind": "sag", "artefact": name, "standard_uncertainty": u[name]} for name in plates]
    source = "0.3 µm of a steel plate of half a metre on three supports, with the square of size"
    sags = listing(dict.fromkeys(u.values()))
    words = ("sag", "rigid plates", f"largest sag known to {sags}", source)
    return _unless_stated(experiment, words, *added)


def _usual_sag(experiment: Experiment, plate: str) -> str:
    """Return the sag of a plate as thick in proportion as one of half a metre that sags by 0.3 µm:
    it grows with the square of size.
    """
    longest = float(np.ptp(experiment.layouts[plate].coordinates, axis=0).max())
    return length_text(float(f"{0.3e-6 * (longest / 0.5) ** 2:.2g}"))


def _drift(experiment: Experiment, stated: Mapping[str, Any]) -> PredictionAssumption | None:
    u = stated.get("drift", "0.3 um/h")
    source = "test of environmental drift, ISO 230-3"
    words = ("drift", "no drift", f"known to {u} along each axis", source)
    added = {"kind": "drift", "axes": {"standard_uncertainty": u}}
    return _unless_stated(experiment, words, added)


def _reindexing(experiment: Experiment, stated: Mapping[str, Any]) -> PredictionAssumption | None:
    if _section(experiment, "head") is None:
        return None
    u = stated.get("reindexing", "0.3 um")
    source = "data sheets of indexing heads"
    words = ("re-indexing", "exact re-indexing", f"known to {u} each time", source)
    return _unless_stated(experiment, words, {"kind": "re-indexing", "standard_uncertainty": u})


def _scatter(experiment: Experiment, stated: Mapping[str, Any]) -> PredictionAssumption | None:
    factor = float(stated.get("scatter", 1.5))
    machine = _section(experiment, "machine")
    values = [length_text(factor * value) for value in experiment.machine.repeatability.tolist()]
    repeatability = values if len(set(values)) > 1 else values[0]
    return PredictionAssumption(
        "scatter",
        "repeatability of the data sheet",
        f"{factor:g} times as large",
        "readings of other days and other probing",
        {"machine": {**machine, "repeatability": repeatability}},
    )


def _degrees(experiment: Experiment, _: Mapping[str, Any]) -> PredictionAssumption | None:
    model = _section(experiment, "error_model")
    counts = {key: model.get(key) for key in ("position_coefficients", "rotation_coefficients")}
    if not all(isinstance(count, int) for count in counts.values()):
        return None
    richer = {**model, **{key: count + 1 for key, count in counts.items()}}
    return PredictionAssumption(
        "model",
        "no further terms of the error model",
        "one more coefficient of each error",
        "one degree more",
        {"error_model": richer},
    )


def _chain(experiment: Experiment, _: Mapping[str, Any]) -> PredictionAssumption | None:
    model = _section(experiment, "error_model")
    arrangement = str(getattr(experiment.error_model, "arrangement", None))
    if arrangement not in EXCHANGED:
        return None
    other = EXCHANGED[arrangement]
    machine = _section(experiment, "true_machine") or {}
    instead, source = other, "the random errors of true_machine"
    if machine.get("kind") != "random":
        machine = {"kind": "random", "position": "2 um", "rotation": "4 urad", "seed": 1}
        instead, source = f"{other}, with errors of 2 µm and 4 µrad", "random errors"
    # A model of its own would not have the other chain.
    machine = {key: value for key, value in machine.items() if key != "error_model"}
    return PredictionAssumption(
        "chain",
        f"chain of axes {arrangement}",
        instead,
        source,
        {"error_model": {**model, "arrangement": other}, "true_machine": machine},
        is_systematic=True,
    )


_FINDERS: tuple[Callable[[Experiment, Mapping[str, Any]], PredictionAssumption | None], ...] = (
    _tips,
    _certificates,
    _temperature,
    _sag,
    _drift,
    _reindexing,
    _scatter,
    _degrees,
    _chain,
)
