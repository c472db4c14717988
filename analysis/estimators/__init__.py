"""Estimators beside the full one: of distances, by reversal, by length equations."""
