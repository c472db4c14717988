"""All influence quantities that a file may state.

A further one of the kernel is a file here, with its settings and its effect in a design, and one
line in `INFLUENCES`; extensions have their own.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Union, get_args

from ...inputs.messages import refused
from ...inputs.open_kinds import OpenKinds
from .drift import DriftSettings
from .position_scale import PositionScaleSettings
from .probing import ProbingSettings
from .protocol import InfluenceSettings
from .reindexing import ReindexingSettings
from .reproducibility import ReproducibilitySettings
from .sag import SagSettings
from .temperature import TemperaturesSettings

INFLUENCES: tuple[type[InfluenceSettings], ...] = (
    # In the order of the documentation.
    TemperaturesSettings,
    ProbingSettings,
    PositionScaleSettings,
    ReproducibilitySettings,
    ReindexingSettings,
    DriftSettings,
    SagSettings,
)
"""Settings class of every kind of influence quantity."""


def once_each(classes: Iterable[type[InfluenceSettings]]) -> None:
    """Say where a kind is one that exists already.

    :raises ExperimentError: two classes have the same kind.
    """
    owners: dict[str, str] = {}
    for model in classes:
        for kind in get_args(model.model_fields["kind"].annotation):
            if kind in owners:
                text = (
                    f'{model.__name__} has the kind "{kind}", as {owners[kind]} has; name another'
                )
                raise refused(__file__, text, "INFLUENCES", line=1)
            owners[kind] = model.__name__


once_each(INFLUENCES)

KINDS = tuple(kind for one in INFLUENCES for kind in get_args(one.model_fields["kind"].annotation))

if TYPE_CHECKING:
    AnyInfluence = InfluenceSettings
else:
    AnyInfluence = Annotated[
        Union[INFLUENCES],  # noqa: UP007
        OpenKinds("influences", InfluenceSettings),
    ]
