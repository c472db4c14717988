# Public names of this package, each loaded from its module when it is first used.
from .curves import Points as Points
from .description import (
    Combination as Combination,
    MachineDescription as MachineDescription,
    ParametricError as ParametricError,
    PowerSeries as PowerSeries,
    reference_functions as reference_functions,
    true_volumetric as true_volumetric,
)
from .error_tables import parse_line as parse_line, parse_point as parse_point
from .fitted_map import (
    FittedMap as FittedMap,
    InCommon as InCommon,
    readings_in_common as readings_in_common,
)
from .interface import (
    fit_map_or_path as fit_map_or_path,
    fitted_map_of as fitted_map_of,
    map_or_path as map_or_path,
)
from .machine_file import load_machine as load_machine
from .map_files import is_map_file as is_map_file, read_map as read_map
from .map_of_fit import data_of as data_of, left_out_words as left_out_words
from .random_errors import (
    RandomPart as RandomPart,
    deviations_at as deviations_at,
    random_part as random_part,
    random_roots as random_roots,
)
from .sigmas_by_campaign import campaign_sigmas as campaign_sigmas, with_sigmas as with_sigmas
from .volumetric import (
    VolumetricModel as VolumetricModel,
    meaning as meaning,
    squareness_field as squareness_field,
    thermal_field as thermal_field,
)
