"""Reading orders of a chosen campaign, with the effect of drift in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from ballplate.planning import (
    HOUR,
    LEAST_CHANGE_OVER,
    ORDERS,
    Campaign,
    ReadingOrder,
    Request,
    run_sheet,
)
from ballplate.presentation import Data, finite, number, table_lines
from ballplate.simulator.experiment import Candidate, Experiment, Pool, Position
from ballplate.simulator.inputs import ExperimentError, refused

from .drift_in_orders import (
    DriftEffect,
    DriftSize,
    drift_effect,
    drift_size,
    is_of_plates,
    parse_drift_size,
)
from .least_drift import least_drift


@dataclass(frozen=True)
class DriftOrders:
    """Effects of a drift of a `size` on a campaign in each order, if requested; `chosen` is the
    reading order.
    """

    chosen: ReadingOrder
    size: DriftSize
    effects: tuple[DriftEffect, ...]

    @staticmethod
    def ensure_size(text: str) -> None:
        """Refuse an invalid size of a drift.

        :raises QuantityError: it is none.
        """
        drift_size(text)

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        pool: Pool,
        request: Request,
        has_begun: bool,
        chosen: Sequence[Candidate],
    ) -> DriftOrders:
        """Return the orders of chosen candidates of a pool, with the effects of drift.

        :raises ExperimentError: an order is asked of a campaign that has begun, or that of the
            least effect of drift where there are length standards.
        """
        offers = _orders(experiment, pool, request, has_begun, chosen)
        wanted = request.order or LEAST_CHANGE_OVER.name
        order = next(offer for offer in offers if offer.name == wanted)
        size = parse_drift_size(request.drift, experiment)
        effects = tuple(
            drift_effect(
                experiment,
                offer.name,
                run_sheet(chosen, pool.changes, order=offer),
                pool.changes,
                size,
            )
            for offer in offers
            if len(offers) > 1
        )
        return cls(order, size, effects)

    def data(self) -> Data:
        """The size of the drift and its effects as plain data."""
        return {
            "drift": asdict(self.size),
            "orders": [_order_data(effect) for effect in self.effects],
        }

    def lines(self, campaign: Campaign) -> list[str]:
        """Return the table of orders; empty without any."""
        return _order_table(self.size, self.effects, campaign) if self.effects else []


def _orders(
    experiment: Experiment,
    pool: Pool,
    request: Request,
    has_begun: bool,
    chosen: Sequence[Candidate],
) -> list[ReadingOrder]:
    """Return all orders if one is requested or a drift is stated."""
    is_asked = bool(request.order or request.drift)
    if has_begun and is_asked:
        text = "has begun, and its times are unknown; leave --order and --drift out"
        raise _impossible(experiment, text)
    if has_begun:
        return [LEAST_CHANGE_OVER]
    positions = [candidate for candidate in chosen if isinstance(candidate.item, Position)]
    orders = [ReadingOrder(name, request.seed) for name in ORDERS if name != "least-drift"]
    if is_of_plates(experiment, positions):
        sequence = least_drift(experiment, chosen, pool.changes, request.seed)
        return [*orders, ReadingOrder("least-drift", request.seed, sequence)]
    if request.order == "least-drift":
        text = "has length standards, whose drift is not modelled; choose another --order"
        raise _impossible(experiment, text)
    return orders


def _impossible(experiment: Experiment, text: str) -> ExperimentError:
    return refused(experiment.source, text, "pool")


def _order_table(size: DriftSize, effects: Sequence[DriftEffect], campaign: Campaign) -> list[str]:
    """Return the table of drift effects by order, with the chosen one marked."""
    budget = campaign.budget.seconds

    def remarks(effect: DriftEffect) -> str:
        is_over = budget is not None and effect.seconds > budget * (1.0 + 1e-9)
        words = ["chosen"] if effect.order == campaign.order.name else []
        return ", ".join(words + (["more hours than allowed"] if is_over else []))

    columns = {
        "order": lambda effect: ORDERS[effect.order],
        "hours": ("seconds", _hours),
        "change-over, h": ("change_seconds", _hours),
        f"{number(1e6 * size.point)} µm/h does": ("of_point", _micrometres),
        f"{number(1e6 * size.scale)} ppm/h does": ("of_scale", _micrometres),
        "U6, no drift": ("without", _micrometres),
        "drift estimated": ("estimated", _micrometres),
        "": remarks,
    }
    table = table_lines(columns, effects)
    places = (step.candidate for step in campaign.sheet.steps)
    if not is_of_plates(campaign.experiment, places):
        why = "no effects of drift: they are computed for plates only"
        return [*table, why]
    return [
        *table,
        "largest change of a distance between corrected points by an unmodelled drift, and mean"
        " uncertainty of such distances; µm",
        *_chosen_without_drift(campaign),
    ]


def _hours(seconds: float) -> str:
    return f"{seconds / HOUR:.2f}"


def _micrometres(value: float) -> str:
    return number(1e6 * value)


def _chosen_without_drift(campaign: Campaign) -> list[str]:
    """Return the remark that the choice ignores the drift of the file."""
    drifts = [influence for influence in campaign.experiment.influences if influence.in_order]
    if not drifts:
        return []
    return [
        "positions were chosen without drift; U1 to U6 are those with the drift of the"
        " file, in the order chosen"
    ]


def _order_data(effect: DriftEffect) -> Data:
    return {
        key: finite(value) if isinstance(value, float) else value
        for key, value in asdict(effect).items()
    }
