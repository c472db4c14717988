"""A small plate of which all distances are certified, read in three planes."""

PLATE = """\
title: a plate
machine: {volume: [600 mm, 500 mm, 400 mm], repeatability: 0.5 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm, -50 mm], right: [60 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [300 mm, 300 mm]}}
positions:
  - {name: low, plane: z, level: 100 mm, corner: {x: 50 mm, y: 50 mm}, probes: [down]}
  - {name: wall, plane: x, level: 200 mm, corner: {y: 50 mm, z: 45 mm}, probes: [right, down]}
  - {name: side, plane: y, level: 200 mm, corner: {z: 45 mm, x: 50 mm}, probes: [down]}
calibration: [{kind: distances, pairs: all, standard_uncertainty: 0.5 um}]
target_uncertainty: 2 um + L/300000
evaluation:
  points: {random: 8, seed: 1}
  probe: down
  tasks: [{name: along x, from: [50 mm, 200 mm, 100 mm], to: [550 mm, 200 mm, 100 mm]}]
"""
