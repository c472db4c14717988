"""Differences of two maps of machines: of fits, epochs, laboratories, or from what is expected."""
