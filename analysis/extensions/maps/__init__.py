"""Error maps used: corrected points, error curves, volumetric errors, comparison."""
