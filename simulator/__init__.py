"""Plans ball-plate experiments for coordinate measuring machines."""
