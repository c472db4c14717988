"""Monte Carlo: repeated estimates of synthetic readings beside the linearised uncertainties."""
