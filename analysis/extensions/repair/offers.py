"""Possible changes of an experiment, and those that its pool offers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from ballplate.simulator.experiment import Experiment, Pool, Position, placed_only

from .certificates import better_certificates, certificates
from .changes import Change, ChangeKind, with_calibration, with_position
from .moves import more_readings, moves, repeats
from .positions import positions
from .reductions import fewer_coefficients, more_balls

Generator = Callable[[Experiment], Iterator[Change]]


def offers(experiment: Experiment, is_deficient: bool = True) -> dict[ChangeKind, list[Change]]:
    """Changes that stay within the volume, by kind; additions are those of the pool where the
    experiment has one.

    What only makes observations more certain is offered where none is missing.
    """
    makers: list[tuple[ChangeKind, Generator]] = [
        (ChangeKind.MOVE, moves),
        (ChangeKind.READ_MORE, more_readings),
    ]
    if not is_deficient:
        makers += [(ChangeKind.READ_MORE, repeats), (ChangeKind.CERTIFICATE, better_certificates)]
    if experiment.pool is not None:
        makers.append((ChangeKind.POOL, pool_additions))
    else:
        makers += [(ChangeKind.CERTIFICATE, certificates), (ChangeKind.ADD_POSITION, positions)]
    makers += [(ChangeKind.ARTEFACT, more_balls), (ChangeKind.MODEL, fewer_coefficients)]
    found: dict[ChangeKind, list[Change]] = {
        kind: [] for kind, _ in sorted(makers, key=lambda one: one[0])
    }
    placed = placed_only(experiment)
    for kind, maker in makers:
        found[kind] += maker(experiment if kind == ChangeKind.POOL else placed)
    return {kind: sorted(changes, key=lambda one: one.cost) for kind, changes in found.items()}


def pool_additions(experiment: Experiment) -> Iterator[Change]:
    """Candidates of the pool that the experiment does not have yet, the cheapest first."""
    pool = experiment.pool
    assert pool is not None
    order = sorted(range(len(pool.candidates)), key=lambda k: pool.candidates[k].seconds)
    for k in order:
        one = pool.candidates[k]
        if one.drawn or not allowed(pool, (k,)):
            continue
        add = (
            partial(with_position, position=one.item)
            if isinstance(one.item, Position)
            else partial(with_calibration, item=one.item)
        )
        words = f'add "{one.name}" of the pool ({duration(one.seconds)})'
        yield Change(
            ChangeKind.POOL,
            words,
            one.seconds,
            frozenset({f"candidate {k}"}),
            add,
            one.item,
            candidate=k,
        )


def allowed(pool: Pool, chosen: tuple[int, ...]) -> bool:
    """Whether the pool's limits allow candidates beside those that are drawn."""
    own = {k for k, one in enumerate(pool.candidates) if one.drawn} | set(chosen)
    return all(len(own & set(limit.members)) <= limit.count for limit in pool.at_most)


def duration(seconds: float) -> str:
    """A time in hours, or in minutes where it is less than one.

    >>> duration(5400), duration(90)
    ('1.5 h', '1.5 min')
    """
    return f"{seconds / 3600:.3g} h" if seconds >= 3600 else f"{seconds / 60:.3g} min"
