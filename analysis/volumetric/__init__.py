"""Volumetric errors of a machine from its parametric errors."""
