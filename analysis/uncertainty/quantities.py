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
    """The functions of a quantity, none in a design without it.

    :raises ValueError: its entry contradicts itself.
    """
    kind = QUANTITIES[symbol]
    try:
        found = kind.functions(design, layout)
    except ValueError as error:
        raise ValueError(f"quantity {symbol}: {error}") from error
    wrong = _wrong_with(kind, found)
    if wrong:
        raise ValueError(f"quantity {symbol}: {wrong}")
    return found


def _wrong_with(kind: QuantityKind, found: object) -> str:
    """What contradicts the kind in what its function made, in words."""
    if not isinstance(found, tuple) or not all(isinstance(one, Functions) for one in found):
        return f"give a tuple of Parameters, Coordinates or Distances, not {shorten(repr(found))}"
    are = {type(one) for one in found}
    if kind.are_lengths and are - {Distances}:
        return "are_lengths goes with Distances only; remove it"
    if kind.effect and Parameters in are:
        return "effect goes with Distances and Coordinates only; remove it"
    # What has names is shown one by one, so that a second group would be left out.
    if len(found) > 1 and not all(isinstance(one, Distances) and not one.names for one in found):
        return "only Distances without names can be in several groups; put all into one"
    return ""


# What all quantities, and the parts of those that have several units, are the uncertainties of.
DESCRIPTIONS: dict[str, str] = {}
for _symbol, _kind in QUANTITIES.items():
    if _symbol.partition(" ")[0] not in QUANTITIES:
        raise ValueError(f'"{_symbol}" is no symbol of a quantity; write it without spaces')
    DESCRIPTIONS[_symbol] = _kind.description
    DESCRIPTIONS |= {f"{_symbol} {word}": description for word, description in _kind.parts.values()}

# Quantities that a sweep records unless told, those whose symbol has a word of its own with the
# whole.
RECORDED = tuple(
    symbol for symbol, kind in QUANTITIES.items() if kind.is_recorded and " " not in symbol
)
# Those that it records if told.
RECORDED_IF_TOLD = tuple(symbol for symbol, kind in QUANTITIES.items() if not kind.is_recorded)
