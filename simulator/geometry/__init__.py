"""Places of balls: on their artefact, and in the machine for each position of the artefact."""
