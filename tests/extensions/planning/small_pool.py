"""A pool of thirteen candidates, whose 8191 selections can all be tried."""

from __future__ import annotations

TEXT = """
title: a small pool
machine: {volume: [600 mm, 500 mm, 400 mm], repeatability: 1 um}
error_model: {kind: kinematic, arrangement: MB2, position_coefficients: 2, rotation_coefficients: 2}
probes:
  down: [0 mm, 0 mm, -50 mm]
  right: [60 mm, 0 mm, 0 mm]
  back: [0 mm, 60 mm, 0 mm]
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [300 mm, 300 mm]}
  bar: {kind: two_spheres, length: 350 mm, role: length_standard}
calibration:
  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.5 um}
target_uncertainty: 2 um + L/300000
evaluation:
  points: {random: 20, seed: 1}
  probe: down
  tasks:
    - {name: along x, from: [50 mm, 200 mm, 100 mm], to: [550 mm, 200 mm, 100 mm]}
    - {name: slanting, from: [50 mm, 50 mm, 50 mm], to: [500 mm, 400 mm, 300 mm], probe: right}
pool:
  times: {set_up: 10 min, reading: 20 s, probe_change: 3 min, plane_change: 20 min}
  candidates:
    - name: flat
      artefact: plate
      planes: [z]
      levels: [50 mm, 350 mm]
      corners: {x: [0 mm, 300 mm], y: 100 mm}
      probes: [down]
    - name: across x
      artefact: plate
      planes: [x]
      levels: [100 mm, 500 mm]
      corners: {y: [0 mm, 200 mm], z: 50 mm}
      quarter_turns: 1
      probes: [[right, down]]
    - name: across y
      artefact: plate
      planes: [y]
      levels: [250 mm]
      corners: {x: [0 mm, 300 mm], z: 50 mm}
      probes: [[back, down]]
      times: {set_up: 25 min}
    - {name: bar, artefact: bar, pose: {origin: [100 mm, 250 mm, 200 mm]}, probes: [down], repeats: 2}
  calibration:
    - {name: sides, artefact: plate, kind: distances, pairs: corner sides, standard_uncertainty: 0.5 um, price: 40 min}
    - name: flatness
      artefact: plate
      kind: coordinates
      balls: all
      standard_uncertainty: {z: 0.7 um}
      price: 50 min
"""
