"""A laid-out experiment as arrays."""
