# Public names of this package, each loaded from its module when it is first used.
from .bounds import (
    EDGE as EDGE,
    OUTSIDE as OUTSIDE,
    TOLERANCE as TOLERANCE,
    Bounds as Bounds,
    check_inside as check_inside,
    edge_of as edge_of,
    entered as entered,
    extent as extent,
    length_of as length_of,
    limits_of as limits_of,
    outline as outline,
    shared as shared,
)
from .calibrated_coordinates import CalibratedBalls as CalibratedBalls
from .calibrations import KINDS as KINDS, resolve_calibration as resolve_calibration
from .certificate_tables import read_rows as read_rows
from .changes import (
    node_at as node_at,
    node_of as node_of,
    overlap as overlap,
    override as override,
    place_of as place_of,
    variant_trees as variant_trees,
)
from .construction import placed_only as placed_only
from .earlier_campaigns import (
    LEAST_SIGMA as LEAST_SIGMA,
    EarlierCampaign as EarlierCampaign,
    MapData as MapData,
    MapShare as MapShare,
)
from .json_schema import DRAFT as DRAFT, schema as schema, tidied as tidied
from .layout import lay_out as lay_out
from .loading import build as build, load as load, trees_of as trees_of, with_pool as with_pool
from .machine import check_ends as check_ends
from .model import (
    AtMost as AtMost,
    Candidate as Candidate,
    ChangeTimes as ChangeTimes,
    Experiment as Experiment,
    Pool as Pool,
    Position as Position,
    Prior as Prior,
    Probe as Probe,
    ReadingGroup as ReadingGroup,
)
from .named_files import (
    existing_file as existing_file,
    files_of_machine as files_of_machine,
    is_rooted as is_rooted,
    keyed_paths as keyed_paths,
    model_modules as model_modules,
    module_files as module_files,
    named_in as named_in,
    python_models as python_models,
    runs_code as runs_code,
)
from .own_sections import check_installed as check_installed
from .pool_sections import (
    GroupSettings as GroupSettings,
    LimitsSettings as LimitsSettings,
    ListedSettings as ListedSettings,
    OwnTimesSettings as OwnTimesSettings,
    PlacesByAxis as PlacesByAxis,
    PoolSettings as PoolSettings,
    RangeSettings as RangeSettings,
    SelectorSettings as SelectorSettings,
    TimesSettings as TimesSettings,
    is_group as is_group,
)
from .position_sections import Edges as Edges
from .positions import check_turns as check_turns, resolve_positions as resolve_positions
from .readings_section import (
    PLACE as PLACE,
    ColumnsSettings as ColumnsSettings,
    CompensationSettings as CompensationSettings,
    Coordinate as Coordinate,
    ReadingsSettings as ReadingsSettings,
    check_rule as check_rule,
)
from .references import References as References, lengths_per_axis as lengths_per_axis
from .sections import (
    InfluenceSettings as InfluenceSettings,
    Line as Line,
    MapPriorSettings as MapPriorSettings,
    Seed as Seed,
    VolumeSettings as VolumeSettings,
)
from .size_checks import check_lengths as check_lengths
from .spans import unspanned as unspanned
from .stated_values import (
    CertificateEntry as CertificateEntry,
    CertificateSettings as CertificateSettings,
    FileValues as FileValues,
    check_keys as check_keys,
    is_digital as is_digital,
    read_digital as read_digital,
    uncertainties_of as uncertainties_of,
    value_name as value_name,
)
from .validation import Sections as Sections
