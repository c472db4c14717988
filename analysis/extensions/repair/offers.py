"""Possible changes of an experiment, and those that its pool offers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from ballplate.simulator.experiment import Experiment, Pool, Position, placed_only

from .certificates import certificates
from .changes import Change, ChangeKind, with_calibration, with_position
from .moves import more_readings, moves
from .positions import positions

Generator = Callable[[Experiment], Iterator[Change]]


def offers(experiment: Experiment) -> dict[ChangeKind, list[Change]]:
    """Return changes within the volume, by class; additions are those of the pool, if the
    experiment has one.
    """
    makers: list[tuple[ChangeKind, Generator]] = [
        (ChangeKind.MOVE, moves),
        (ChangeKind.READ_MORE, more_readings),
    ]
    if experiment.pool is not None:
        makers.append((ChangeKind.POOL, pool_additions))
    else:
        makers += [(ChangeKind.CERTIFICATE, certificates), (ChangeKind.ADD_POSITION, positions)]
    by_kind: dict[ChangeKind, list[Change]] = {
        kind: [] for kind, _ in sorted(makers, key=lambda maker: maker[0])
    }
    placed = placed_only(experiment)
    for kind, maker in makers:
        by_kind[kind] += maker(experiment if kind == ChangeKind.POOL else placed)
    return {
        kind: sorted(changes, key=lambda change: change.cost) for kind, changes in by_kind.items()
    }


def pool_additions(experiment: Experiment) -> Iterator[Change]:
    """Candidates of the pool that the experiment does not have yet, the cheapest first."""
    pool = experiment.pool
    assert pool is not None
    order = sorted(range(len(pool.candidates)), key=lambda k: pool.candidates[k].seconds)
    for k in order:
        candidate = pool.candidates[k]
        if candidate.drawn or not allowed(pool, (k,)):
            continue
        add = (
            partial(with_position, position=candidate.item)
            if isinstance(candidate.item, Position)
            else partial(with_calibration, item=candidate.item)
        )
        words = f'add "{candidate.name}" of the pool ({duration(candidate.seconds)})'
        yield Change(
            ChangeKind.POOL,
            words,
            candidate.seconds,
            frozenset({f"candidate {k}"}),
            add,
            candidate.item,
            candidate=k,
        )


def allowed(pool: Pool, chosen: tuple[int, ...]) -> bool:
    """True if the pool's limits allow candidates in addition to chosen ones."""
    drawn = {k for k, candidate in enumerate(pool.candidates) if candidate.drawn} | set(chosen)
    return all(len(drawn & set(limit.members)) <= limit.count for limit in pool.at_most)


def duration(seconds: float) -> str:
    """Return a time in hours, or in minutes below one hour.

    >>> duration(5400), duration(90)
    ('1.5 h', '1.5 min')
    """
    return f"{seconds / 3600:.3g} h" if seconds >= 3600 else f"{seconds / 60:.3g} min"
