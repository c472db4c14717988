"""Search of a fit's residuals for what contradicts its experiment."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.simulator.computing import single_threaded
from ballplate.simulator.estimation import Linearisation
from ballplate.simulator.inputs import Mark
from ballplate.simulator.machines import Array

from .assumptions_tested import assumptions_tested
from .exact_values import searched_with_exact_values
from .findings import Diagnosis
from .remainders import too_many_entries
from .wording import findings


@single_threaded
def diagnosed(
    at: Linearisation, x: Array, sigma_is_estimated: bool, marks: Sequence[Mark] = ()
) -> tuple[Diagnosis, str]:
    """Return the causes of a fit's residuals, and the reason if there was no search; `marks` locate
    the readings in their file.
    """
    untested = too_many_entries(at.design)
    search = None if untested else searched_with_exact_values(at, x, sigma_is_estimated)
    if search is None:
        return Diagnosis(), untested
    return Diagnosis(tuple(findings(search, marks)), tuple(assumptions_tested(search))), ""
