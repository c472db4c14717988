"""Groupings of observations for variance components."""

from __future__ import annotations

from typing import Literal, get_args

Grouping = Literal["axis", "probe", "position", "artefact", "calibration"]

GROUPINGS: tuple[Grouping, ...] = get_args(Grouping)
