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
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import (
    MOST_MESSAGES,
    PARSERS,
    SMALLEST,
    CsvWriter,
    ExperimentError,
    FileRow,
    GivenText,
    Message,
    QuantityError,
    format_path,
    header_names,
    hint,
    length_text,
    listing,
    read_table,
    read_text,
    refused,
)
from ballplate.simulator.machines import Array, ErrorModel
from ballplate.simulator.readings import Simulated

COLUMNS = ("item", "first", "second", "value")
AXES = "xyz"
UNIT_NAMES = {"rad": "rad", "1": "m/m"}


def certified_values(experiment: Experiment) -> list[CertifiedValue]:
    """All values that certificates, probes and priors of an experiment state, in its order."""
    values = [
        replace(certified_value, item=format_path(("calibration", k)))
        for k, item in enumerate(experiment.calibration)
        for certified_value in item.certified_values(experiment.layout_of(item))
    ]
    for probe, axis, value, u in experiment.certified_offsets:
        item = format_path(("probes", probe.name))
        values.append(CertifiedValue(item, "offset", AXES[axis], value, u))
    for k, star in enumerate(experiment.stars):
        item, u = format_path(("stars", k)), star.standard_uncertainty
        for (tip, letter), value in zip(star.names, star.coordinates.ravel().tolist(), strict=True):
            values.append(CertifiedValue(item, tip, letter, value, u))
    for prior in experiment.priors:
        item = prior.path.rpartition(".")[0]
        values.append(
            CertifiedValue(
                item, prior.name, "value", prior.value, prior.standard_uncertainty, prior.unit
            )
        )
    return values


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
        probes_of_star = [design.probes.names.index(name) for name in star.probes]
        true += star.true_values(truth.probes[probes_of_star]).tolist()
    true += priors[: len(experiment.priors)].tolist()
    if generator is None:
        return np.array(true, float)
    uncertainty = np.array([value.standard_uncertainty for value in certified_values(experiment)])
    normal = generator.standard_normal(len(true))
    errors, start = uncertainty * normal, 0
    for item, probes_of_star in zip(experiment.calibration, of_items, strict=True):
        part = slice(start, start + len(probes_of_star))
        errors[part] = item.drawn_errors(normal[part], uncertainty[part])
        start = part.stop
    return np.array(true, float) + errors


def certificate_rows(experiment: Experiment) -> Iterator[tuple[str, str, str, str]]:
    """All values that an experiment states, with all digits, as rows of `COLUMNS`."""
    for certified_value in certified_values(experiment):
        # Less than can be read again is rounding, such as that of the cosine of a right angle.
        value = certified_value.value if abs(certified_value.value) >= SMALLEST else 0.0
        text = (
            length_text(value)
            if certified_value.unit == "m"
            else f"{value!r} {UNIT_NAMES[certified_value.unit]}"
        )
        yield certified_value.item, certified_value.first, certified_value.second, text


def write_certificate(stream: TextIO, experiment: Experiment, comment: str) -> None:
    """Write all values that an experiment states, below a line of comment."""
    stream.write(f"# {comment}\n")
    writer = CsvWriter(stream)
    writer.writerow(COLUMNS)
    writer.writerows(certificate_rows(experiment))


def with_drawn_values(experiment: Experiment, simulated: Simulated) -> Experiment:
    """An experiment with values of its certificates, priors and probe offsets that go with readings
    that have just been simulated.
    """
    values = drawn_values(
        experiment, simulated.design, simulated.truth, simulated.model, simulated.generator
    )
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
    """An experiment with the certificate values of a file instead of its own.

    :raises ExperimentError: a wrong table; a value that the experiment does not have, or has
        already, or that is far from the drawing; values that are missing, or exact and
        contradictory. All of them at once.
    """
    problems: list[Message] = []
    table = path if isinstance(path, GivenText) else GivenText(str(path), read_text(path))
    if is_calibration_table(table):
        advice = (
            "this is a table of the certified values of one calibration; name it in the experiment"
            f" file under calibration: values: {Path(path.name).name}, and leave --certificate out"
        )
        raise refused(path, advice, line=1)
    rows = read_table(table, COLUMNS, [], problems=problems)
    values_known = certified_values(experiment)
    if not values_known:
        text = (
            "the experiment has no certificate, prior or probe offset with an uncertainty; leave"
            " the file out"
        )
        raise refused(path, text)
    place = {certified_value.key: k for k, certified_value in enumerate(values_known)}
    pairs = {certified_value.item for certified_value in values_known if certified_value.is_pair}
    values, lines = np.full(len(values_known), np.nan), dict[int, FileRow]()
    for row in rows[:MOST_MESSAGES] if problems else rows:
        item, first, second, text = row.texts
        names = sorted((first, second)) if item in pairs else [first, second]
        k = place.get((item, names[0], names[1]))
        if k is None:
            problems.append(row.mark.message("", _unknown(row, values_known)))
            continue
        if k in lines:
            advice = (
                f"{item} has {first}, {second} in line {lines[k].mark.line} already; remove one of"
                " the two"
            )
            problems.append(row.mark.message("", advice))
            continue
        lines[k] = row
        try:
            values[k] = PARSERS[values_known[k].unit](text.replace(",", "."))
        except QuantityError as error:
            problems.append(row.mark.message("", str(error)))
            continue
        drawn = values_known[k].drawn
        if drawn is not None and not abs(values[k] - drawn) <= FAR_FROM_DRAWING * drawn:
            advice = f"{far_from_drawing(values[k], drawn)}; correct one of the two"
            problems.append(row.mark.message("", advice))
    missing = [
        f"{certified_value.item} {certified_value.first}, {certified_value.second}"
        for k, certified_value in enumerate(values_known)
        if k not in lines
    ]
    if missing and not problems:
        problems.append(Message(str(path), 1, 1, "", f"no value of {listing(missing)}; add it"))
    if problems:
        raise ExperimentError(sorted(problems)[:MOST_MESSAGES])
    changed = with_values(experiment, values)
    doubts = (item.doubt(changed.layout_of(item)) for item in changed.calibration)
    wrong = [Message(str(path), 1, 1, "", text) for text in doubts if text]
    if wrong:
        raise ExperimentError(wrong)
    return changed


def _unknown(row: FileRow, values_known: list[CertifiedValue]) -> str:
    item, first, second, _ = row.texts
    of_item = [value for value in values_known if value.item == item]
    if not of_item:
        return (
            f'the experiment has no certified "{item}";'
            f" {hint(item, dict.fromkeys(value.item for value in values_known))}"
        )
    names = [f"{value.first}, {value.second}" for value in of_item]
    return f'{item} has no "{first}, {second}"; {hint(f"{first}, {second}", names)}'


def is_calibration_table(source: GivenText) -> bool:
    """True if a table has the certified values of one calibration, which name no item."""
    names = header_names(source)
    of_pairs = names >= {"first", "second", "value"}
    return "item" not in names and (of_pairs or names >= {"ball", "x", "y"})


class CertificateFiles:
    """The functions that read and write values of certificates."""

    ensure_certified = staticmethod(ensure_certified)
    certified_values = staticmethod(certified_values)
    with_drawn_values = staticmethod(with_drawn_values)
    write = staticmethod(write_certificate)
    read = staticmethod(read_certificate)
