"""All quantities whose uncertainties are reported: those of the kernel, and of extensions.

`run`, Monte Carlo, sweeps, plans, reliability, goals and reports read `QUANTITIES`.
"""

from __future__ import annotations

from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.functions import Distances, Functions, Parameters
from ballplate.simulator.inputs.extensions import names, provided
from ballplate.simulator.inputs.settings import shorten
from ballplate.simulator.inputs.unusable import UnusableError

from .kernel_quantities import KERNEL_QUANTITIES, QuantityKind


def _of_extension(symbol: str) -> QuantityKind:
    kind = provided("quantities", symbol, "QUANTITY")
    if not isinstance(kind, QuantityKind):
        raise UnusableError(f"quantity {symbol}: {shorten(repr(kind))} is no QuantityKind")
    if " " in symbol:
        raise UnusableError(f"quantity {symbol}: write its symbol without spaces")
    return kind


QUANTITIES: dict[str, QuantityKind] = KERNEL_QUANTITIES | {
    symbol: _of_extension(symbol) for symbol in names("quantities", with_registered=True)
}


def functions_of(symbol: str, design: Design, layout: SharedLayout) -> tuple[Functions, ...]:
    """Return the functions of a quantity, empty in a design without it.

    :raises UnusableError: the entry is inconsistent, or what its function returns.
    """
    kind = QUANTITIES[symbol]
    try:
        functions = kind.functions(design, layout)
    except ValueError as error:
        raise UnusableError(f"quantity {symbol}: {error}") from error
    fault = _fault_of(kind, functions)
    if fault:
        raise UnusableError(f"quantity {symbol}: {fault}")
    return functions


def _fault_of(kind: QuantityKind, groups: object) -> str:
    """Return a contradiction between a quantity and its functions, or an empty text."""
    if not isinstance(groups, tuple) or not all(isinstance(group, Functions) for group in groups):
        return f"give a tuple of Parameters, Coordinates or Distances, not {shorten(repr(groups))}"
    types = {type(group) for group in groups}
    if kind.are_lengths and types - {Distances}:
        return "are_lengths applies to Distances only; remove it"
    if kind.effect and Parameters in types:
        return "effect applies to Distances and Coordinates only; remove it"
    # Only one group of names is shown.
    if len(groups) > 1 and not all(
        isinstance(group, Distances) and not group.names for group in groups
    ):
        return "only Distances without names can be in several groups; combine all in one"
    return ""


# Descriptions of quantities and of their parts by unit.
DESCRIPTIONS: dict[str, str] = {}
for _symbol, _kind in QUANTITIES.items():
    if _symbol.partition(" ")[0] not in QUANTITIES:
        raise ValueError(f'"{_symbol}" is no symbol of a quantity; write it without spaces')
    DESCRIPTIONS[_symbol] = _kind.description
    DESCRIPTIONS |= {f"{_symbol} {word}": description for word, description in _kind.parts.values()}

# Quantities that a sweep records by default, with their parts.
RECORDED = tuple(
    symbol for symbol, kind in QUANTITIES.items() if kind.is_recorded and " " not in symbol
)
# Quantities that a sweep records on request.
RECORDED_IF_TOLD = tuple(symbol for symbol, kind in QUANTITIES.items() if not kind.is_recorded)
