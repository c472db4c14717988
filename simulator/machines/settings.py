"""Keys of error models in a file, and their models.

A new error model of the kernel is one file with its keys and an `ErrorModelKind`, and one entry of
`ERROR_MODELS`; extensions provide their own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args

from ballplate.simulator.inputs.extensions import provided
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.settings import Settings, listing
from ballplate.simulator.inputs.validation import OpenKinds
from pydantic import Field

from .empirical_settings import EMPIRICAL
from .kinematic_settings import KINEMATIC
from .protocol import Corner, ErrorModel, ErrorModelKind

if TYPE_CHECKING:
    from .metric import Scale


class MetricSettings(Settings):
    """A machine of straight axes: squareness and scales."""

    kind: Literal["metric"] = Field(
        description="straight axes that need not be square, and their scales"
    )
    scale: Literal["none", "x", "y", "split", "each"] | None = Field(
        default=None,
        description=(
            "In two dimensions the axis with the scale difference gamma: x, y, split (both), or"
            " none (default). In three dimensions each (default), for a scale error of every"
            " axis, or none."
        ),
    )

    @property
    def plane_scale(self) -> Scale:
        """The axis with the scale difference in two dimensions."""
        return "none" if self.scale is None or self.scale == "each" else self.scale


def _metric(settings: MetricSettings, lower: Corner, upper: Corner) -> ErrorModel:
    from .metric import MetricModel, SpatialMetricModel

    if len(lower) == 3:
        return SpatialMetricModel(settings.scale != "none", lower, upper)
    return MetricModel(settings.plane_scale, max(b - a for a, b in zip(lower, upper, strict=True)))


def _wrong_metric(settings: MetricSettings, dimension: int) -> list[tuple[Steps, str]]:
    allowed = ("none", "x", "y", "split") if dimension == 2 else ("each", "none")
    if settings.scale is None or settings.scale in allowed:
        return []
    text = f"has no meaning in {dimension} dimensions; choose from: {listing(allowed)}"
    return [(("scale",), text)]


def _metric_with_defaults(settings: MetricSettings, dimension: int) -> MetricSettings:
    if settings.scale is not None:
        return settings
    return settings.model_copy(update={"scale": "none" if dimension == 2 else "each"})


ERROR_MODELS: tuple[ErrorModelKind, ...] = (
    KINEMATIC,
    EMPIRICAL,
    ErrorModelKind(
        MetricSettings, _metric, wrong=_wrong_metric, with_defaults=_metric_with_defaults
    ),
)
"""The kernel's types of error model."""

_KINDS = {kind.settings: kind for kind in ERROR_MODELS}

KINDS = tuple(kind for keys in _KINDS for kind in get_args(keys.model_fields["kind"].annotation))

ErrorModelSettings = Annotated[  # type: ignore[valid-type]
    Union[tuple(_KINDS)],  # noqa: UP007
    OpenKinds("error_models"),
]


def kind_of(settings: Settings) -> ErrorModelKind:
    """Return the type of a described error model."""
    if type(settings) in _KINDS:
        return _KINDS[type(settings)]
    kind: Any = provided("error_models", vars(settings)["kind"], "ERROR_MODEL")
    assert isinstance(kind, ErrorModelKind)
    return kind


def with_defaults(settings: Settings, dimension: int) -> Settings:
    """Return settings of an error model with defaults for the number of dimensions.

    >>> with_defaults(MetricSettings(kind="metric"), 3).scale
    'each'
    """
    return kind_of(settings).with_defaults(settings, dimension)


def build_error_model(settings: Settings, lower: Corner, upper: Corner) -> ErrorModel:
    """Return the described error model, for a volume from `lower` to `upper` in metres.

    :raises CustomModelError: a user's own model is unusable.

    >>> build_error_model(MetricSettings(kind="metric"), (0.0, 0.0), (1.0, 1.0)).dimension
    2
    """
    return kind_of(settings).build(settings, lower, upper)
