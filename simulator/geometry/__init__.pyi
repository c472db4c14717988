# Public names of this package, each loaded from its module when it is first used.
from .artefacts import (
    BryanGaugeSettings as BryanGaugeSettings,
    GridSettings as GridSettings,
    SquareSettings as SquareSettings,
    TwoSpheresSettings as TwoSpheresSettings,
)
from .ball_layouts import (
    ArtefactSettings as ArtefactSettings,
    BallLayout as BallLayout,
    Name as Name,
    even_grid as even_grid,
    frozen as frozen,
    pairs as pairs,
)
from .motions import (
    AXIS_NAMES as AXIS_NAMES,
    FLAT as FLAT,
    cross_matrices as cross_matrices,
    fit_motion as fit_motion,
    fit_sphere as fit_sphere,
    fixes_pose as fixes_pose,
    pose_size as pose_size,
    rigid_motions as rigid_motions,
    rotation_from_vector as rotation_from_vector,
    rotation_matrix as rotation_matrix,
    vector_from_rotation as vector_from_rotation,
    without_rigid_motion as without_rigid_motion,
)
from .poses import (
    AXIS_INDEX as AXIS_INDEX,
    IN_PLANE_AXES as IN_PLANE_AXES,
    QUARTER_TURNS as QUARTER_TURNS,
    Axis as Axis,
    PlanePlacement as PlanePlacement,
    Pose as Pose,
    ball_coordinates as ball_coordinates,
    corner_points as corner_points,
    nominal_pose as nominal_pose,
    plane_rotation as plane_rotation,
)
