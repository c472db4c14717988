"""A design that is quick to judge."""

from pathlib import Path

from ballplate.designs import shipped

TEXT = Path(shipped("quickstart.yaml")).read_text(encoding="utf-8")
SMALL = TEXT.replace("[5, 5]", "[3, 3]").replace("coefficients: 5", "coefficients: 3")
SMALL = SMALL.replace("random: 200", "random: 20")
"""The quickstart with fewer balls, coefficients and lengths."""
