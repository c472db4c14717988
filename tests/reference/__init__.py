"""Independent computations that the tests of the estimator are compared with."""
