"""What repeated estimates of synthetic readings tell beside the linearised uncertainties."""
