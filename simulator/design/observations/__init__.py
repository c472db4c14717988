"""Classes of observations: one file each; calibrations are listed in `experiment.calibrations`."""
