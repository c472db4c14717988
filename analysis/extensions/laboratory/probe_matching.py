"""Matching of probes of tables to those of the experiment, by the plan and by location."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.inputs import FileRow, listing
from ballplate.simulator.machines import Array, Integers

from .heading_words import quoted

# Locations (m, d) in the machine of the balls of rows.
Places = Callable[[Sequence[FileRow]], Array]

# The offset of the probe brings readings this many times nearer to nominal locations than others.
CLEARER = 3.0


def matched_probes(
    rows: Sequence[FileRow], design: Design, places: Places | None
) -> tuple[dict[str, str], str]:
    """Return the probe of each unknown name, or the question which they are.

    A name is that of the only probe planned in all of its positions, or of the one whose offset
    brings the readings to the nominal locations. Where plan and location disagree, neither does.
    A few unknown names among known ones are slips of the pen, and stay.
    """
    known, used = design.probes.names, {row.texts[2] for row in rows}
    unknown = sorted(used.difference(known))
    order = {name: k for k, name in enumerate(design.positions.names)}
    balls = {name: i for i, name in enumerate(design.balls.names)}
    is_placed = all(row.texts[0] in order and row.texts[1] in balls for row in rows)
    if "" in used or 2 * len(unknown) <= len(used) or not is_placed:
        return {}, ""
    matched: dict[str, str] = {}
    for name in unknown:
        own = [row for row in rows if row.texts[2] == name]
        index = [(order[row.texts[0]], balls[row.texts[1]]) for row in own]
        options = set(range(len(known)))
        for k in {k for k, _ in index}:
            options &= {*design.readings.probe[design.readings.position == k].tolist()}
        if places is not None:
            nominal = np.concatenate([nominal_places(design, k, np.array([i])) for k, i in index])
            as_probes = (
                [replace(row, texts=(*row.texts[:2], probe)) for row in own] for probe in known
            )
            apart = [float(np.abs(places(each) - nominal).mean()) for each in as_probes]
            nearest = int(np.argmin(apart))
            if sum(distance <= CLEARER * apart[nearest] for distance in apart) == 1:
                options &= {nearest}
        if len(options) == 1:
            matched[name] = known[options.pop()]
    if len(used.intersection(known).union(matched.values())) == len(used):
        return matched, ""
    return {}, (
        f"the probes {quoted(unknown)} are not in the experiment, and neither the plan nor their"
        f" places tell which they are; write the names that it has: {listing(known)}"
    )


def nominal_places(design: Design, position: int, balls: Integers) -> Array:
    """Return nominal locations (m, d) of balls of an artefact in a position."""
    planned = design.positions
    return design.balls.places[balls] @ planned.rotations[position].T + planned.origins[position]
