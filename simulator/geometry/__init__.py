"""Ball co-ordinates: on the artefact, and in the machine for each of its positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .artefacts import BryanGaugeSettings, GridSettings, SquareSettings, TwoSpheresSettings
    from .axes import PlateAxes, axes_words, in_plate_axes, plate_axes
    from .ball_layouts import ArtefactSettings, BallLayout, Name, frozen, pairs
    from .grids import even_grid
    from .motions import (
        AXIS_NAMES,
        cross_matrices,
        fit_motion,
        fixes_pose,
        pose_size,
        rigid_motions,
        rotation_from_vector,
        vector_from_rotation,
        without_rigid_motion,
    )
    from .positions import (
        AXIS_INDEX,
        IN_PLANE_AXES,
        QUARTER_TURNS,
        Axis,
        PlanePlacement,
        Pose,
        ball_coordinates,
        corners,
        nominal_pose,
        plane_rotation,
    )
    from .rotations import rotation_matrix

__getattr__, __dir__ = lazily(__name__, __file__)
