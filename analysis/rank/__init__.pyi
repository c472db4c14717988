# Public names of this package, each loaded from its module when it is first used.
from .directions import Direction as Direction, length as length, moved_positions as moved_positions
from .verdicts import (
    Verdict as Verdict,
    null_changes as null_changes,
    rank_complaint as rank_complaint,
    verdict as verdict,
    weak_changes as weak_changes,
)
