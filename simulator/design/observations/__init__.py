"""Classes of observations: one file each, entered in `kinds`."""
