"""Certificate values in a file of their own: those of an experiment's certificates, offsets of
probes and priors.

A row for each value has the columns item (a path in the experiment file), first and second (what it
is of) and value:

    calibration[0],r1c1,r1c5,600.0001 mm    a distance between two balls
    calibration[1],r1c1,x,0.0002 mm         a co-ordinate of a ball calibration[2],gauge,radius,300
    mm      the radius of a Bryan gauge probes.right,offset,x,50.001 mm         an offset that is
    estimated, and has a standard uncertainty priors[0],EXX t^2,value,3.1 um          a prior
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TextIO

import numpy as np
from ballplate.simulator.design import (
    FAR_FROM_DRAWING,
    CertifiedValue,
    Design,
    Priors,
    State,
    far_from_drawing,
)
from ballplate.simulator.experiment import Experiment, doubt_of_table, exact_contradictions
from ballplate.simulator.inputs import (
    MOST_MESSAGES,
    SMALLEST,
    CsvWriter,
    ExperimentError,
    FileRow,
    GivenText,
    Message,
    QuantityError,
    format_path,
    headings,
    hint,
    length_text,
    listing,
    parse_angle,
    parse_length,
    parse_ratio,
    read_table,
    read_text,
    refused,
)
from ballplate.simulator.machines import Array, ErrorModel
from ballplate.simulator.readings import Simulated

COLUMNS = ("item", "first", "second", "value")
AXES = "xyz"
PARSERS = {"m": parse_length, "rad": parse_angle, "1": parse_ratio}
UNIT_NAMES = {"rad": "rad", "1": "m/m"}


def certified_values(experiment: Experiment) -> list[CertifiedValue]:
    """All values that certificates, probes and priors of an experiment state, in its order."""
    found = [
        replace(one, item=format_path(("calibration", k)))
        for k, item in enumerate(experiment.calibration)
        for one in item.certified_values(experiment.layout_of(item))
    ]
    for probe, axis, value, u in experiment.certified_offsets:
        item = format_path(("probes", probe.name))
        found.append(CertifiedValue(item, "offset", AXES[axis], value, u))
    for k, star in enumerate(experiment.stars):
        item, u = format_path(("stars", k)), star.standard_uncertainty
        for (tip, letter), value in zip(star.names, star.coordinates.ravel().tolist(), strict=True):
            found.append(CertifiedValue(item, tip, letter, value, u))
    for prior in experiment.priors:
        item = prior.path.rpartition(".")[0]
        found.append(
            CertifiedValue(
                item, prior.name, "value", prior.value, prior.standard_uncertainty, prior.unit
            )
        )
    return found


def with_values(experiment: Experiment, values: Array) -> Experiment:
    """An experiment whose `certified_values` are others (m,), in the same order, in metres, radians
    and ratios.
    """
    at = 0

    def taken(count: int) -> Array:
        nonlocal at
        at += count
        part = np.array(values[at - count : at], float)
        part.setflags(write=False)
        return part

    calibration = tuple(
        item.with_values(taken(len(list(item.certified_values(experiment.layout_of(item))))))
        for item in experiment.calibration
    )
    probes = dict(experiment.probes)
    for probe, axis, _, _ in experiment.certified_offsets:
        offset = np.where(np.arange(len(probe.offset)) == axis, taken(1), probes[probe.name].offset)
        probes[probe.name] = replace(probe, offset=offset)
    stars = tuple(star.with_values(taken(star.coordinates.size)) for star in experiment.stars)
    priors = tuple(replace(prior, value=float(taken(1)[0])) for prior in experiment.priors)
    return replace(experiment, calibration=calibration, probes=probes, stars=stars, priors=priors)


def drawn_values(
    experiment: Experiment,
    design: Design,
    truth: State,
    model: ErrorModel,
    generator: np.random.Generator | None,
) -> Array:
    """Values (m,) of the `certified_values` of artefacts, probes and a machine that truly are
    `truth`.

    Each is wrong by its standard uncertainty times a normal number; without a `generator` they are
    exact. `design` is the experiment's, and `model` the error model of the true machine. Priors
    about another model's parameters are drawn about what the file states.
    """
    true: list[float] = []
    names = list(experiment.artefacts)
    first_ball = {
        name: int(np.flatnonzero(design.balls.artefact == names.index(name))[0]) for name in names
    }
    of_items = [
        item.true_values(design, truth, model, first_ball.get(item.artefact, 0)).tolist()
        for item in experiment.calibration
    ]
    true += chain.from_iterable(of_items)
    # Those of offsets come last in the design, and first here.
    priors = design.of(Priors).true_values(design, truth, model)
    priors = priors[design.of(Priors).of_influence < 0]
    true += priors[len(experiment.priors) :].tolist()
    for star in experiment.stars:
        own = [design.probes.names.index(name) for name in star.probes]
        true += star.true_values(truth.probes[own]).tolist()
    true += priors[: len(experiment.priors)].tolist()
    if generator is None:
        return np.array(true, float)
    uncertainty = np.array([one.standard_uncertainty for one in certified_values(experiment)])
    normal = generator.standard_normal(len(true))
    errors, at = uncertainty * normal, 0
    for item, own in zip(experiment.calibration, of_items, strict=True):
        part = slice(at, at + len(own))
        errors[part] = item.drawn_errors(normal[part], uncertainty[part])
        at = part.stop
    return np.asarray(np.array(true, float) + errors)


def certificate_rows(experiment: Experiment) -> Iterator[tuple[str, str, str, str]]:
    """All values that an experiment states, with all digits, as rows of `COLUMNS`."""
    for one in certified_values(experiment):
        # Less than can be read again is rounding, such as that of the cosine of a right angle.
        value = one.value if abs(one.value) >= SMALLEST else 0.0
        text = length_text(value) if one.unit == "m" else f"{value!r} {UNIT_NAMES[one.unit]}"
        yield one.item, one.first, one.second, text


def write_certificate(stream: TextIO, experiment: Experiment, comment: str) -> None:
    """Write all values that an experiment states, below a line of comment."""
    stream.write(f"# {comment}\n")
    writer = CsvWriter(stream)
    writer.writerow(COLUMNS)
    writer.writerows(certificate_rows(experiment))


def with_drawn_values(experiment: Experiment, found: Simulated) -> Experiment:
    """An experiment with values of its certificates, priors and probe offsets that go with readings
    that have just been simulated.
    """
    values = drawn_values(experiment, found.design, found.truth, found.model, found.generator)
    return with_values(experiment, values)


def ensure_certified(experiment: Experiment) -> None:
    """Refuse an experiment that states no value with an uncertainty.

    :raises ExperimentError: it does not.
    """
    if not certified_values(experiment):
        text = (
            "there is no certificate, prior or probe offset with an uncertainty; leave"
            " --certificate out"
        )
        raise refused(experiment.source, text)


def read_certificate(path: Path | GivenText, experiment: Experiment) -> Experiment:
    """An experiment with the certificate values of a file instead of its own, and further `doubts`
    where tables of stars are not those of its probes.

    :raises ExperimentError: a wrong table; a value that the experiment does not have, or has
        already, or that is far from the drawing; values that are missing, or exact and
        contradictory. All of them at once.
    """
    problems: list[Message] = []
    table = path if isinstance(path, GivenText) else GivenText(str(path), read_text(path))
    if is_calibration_table(table):
        told = (
            "this is a table of the certified values of one calibration; name it in the experiment"
            f" file under calibration: values: {Path(path.name).name}, and leave --certificate out"
        )
        raise refused(path, told, line=1)
    rows = read_table(table, COLUMNS, [], problems=problems)
    known = certified_values(experiment)
    if not known:
        text = (
            "the experiment has no certificate, prior or probe offset with an uncertainty; leave"
            " the file out"
        )
        raise refused(path, text)
    place = {one.key: k for k, one in enumerate(known)}
    pairs = {one.item for one in known if one.is_pair}
    values, lines = np.full(len(known), np.nan), dict[int, FileRow]()
    for row in rows[:MOST_MESSAGES] if problems else rows:
        item, first, second, text = row.texts
        names = sorted((first, second)) if item in pairs else [first, second]
        k = place.get((item, names[0], names[1]))
        if k is None:
            problems.append(row.mark.message("", _unknown(row, known)))
            continue
        if k in lines:
            told = (
                f"{item} has {first}, {second} in line {lines[k].mark.line} already; remove one of"
                " the two"
            )
            problems.append(row.mark.message("", told))
            continue
        lines[k] = row
        try:
            values[k] = PARSERS[known[k].unit](text)
        except QuantityError as error:
            problems.append(row.mark.message("", str(error)))
            continue
        drawn = known[k].drawn
        if drawn is not None and not abs(values[k] - drawn) <= FAR_FROM_DRAWING * drawn:
            told = f"{far_from_drawing(values[k], drawn)}; correct one of the two"
            problems.append(row.mark.message("", told))
    missing = [
        f"{one.item} {one.first}, {one.second}" for k, one in enumerate(known) if k not in lines
    ]
    if missing and not problems:
        problems.append(Message(str(path), 1, 1, "", f"no value of {listing(missing)}; add it"))
    if problems:
        raise ExperimentError(sorted(problems)[:MOST_MESSAGES])
    found = with_values(experiment, values)
    wrong = [Message(str(path), 1, 1, "", text) for text in _wrong_together(found)]
    if wrong:
        raise ExperimentError(wrong)
    return replace(found, doubts=(*experiment.doubts, *_doubts_of_stars(path, found, experiment)))


def _wrong_together(found: Experiment) -> Iterator[str]:
    """Faults of certified values of which each is possible."""
    for one in found.calibration:
        if text := one.doubt(found.layout_of(one)):
            yield text
    plates = [name for name, one in found.artefacts.items() if one.role != "length_standard"]
    calibrations = dict(enumerate(found.calibration))
    for _, text in exact_contradictions(calibrations, plates, found.layouts):
        yield text


def _doubts_of_stars(
    path: Path | GivenText, found: Experiment, experiment: Experiment
) -> Iterator[str]:
    """What is unlikely of stars whose values are those of a file, where it was not before."""
    for k, (star, before) in enumerate(zip(found.stars, experiment.stars, strict=True)):
        offsets = np.array([found.probes[name].offset for name in star.probes])
        text = doubt_of_table(star, offsets)
        if text and text != doubt_of_table(before, offsets):
            yield f"{path}: {format_path(('stars', k))}: {text}"


def _unknown(row: FileRow, known: list[CertifiedValue]) -> str:
    item, first, second, _ = row.texts
    own = [one for one in known if one.item == item]
    if not own:
        return (
            f'the experiment has no certified "{item}";'
            f" {hint(item, dict.fromkeys(one.item for one in known))}"
        )
    names = [f"{one.first}, {one.second}" for one in own]
    return f'{item} has no "{first}, {second}"; {hint(f"{first}, {second}", names)}'


def is_calibration_table(source: GivenText) -> bool:
    """True if a table has the certified values of one calibration, which name no item."""
    names = headings(source.text)
    of_pairs = names >= {"first", "second", "value"}
    return "item" not in names and (of_pairs or names >= {"ball", "x", "y"})


class CertificateFiles:
    """The functions that read and write values of certificates."""

    ensure_certified = staticmethod(ensure_certified)
    certified_values = staticmethod(certified_values)
    with_drawn_values = staticmethod(with_drawn_values)
    write = staticmethod(write_certificate)
    read = staticmethod(read_certificate)
