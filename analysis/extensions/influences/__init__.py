"""Influence quantities: what disturbs readings in the laboratory, one file for each kind."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs import lazily

# What other extensions build on.
if TYPE_CHECKING:
    from .displacements import SharedDisplacements
    from .drift import Drift, even_clock
    from .sag import Sag, SagSettings
    from .temperature import TemperaturesSettings

__getattr__, __dir__ = lazily(__name__, __file__)
