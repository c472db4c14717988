# Public names of this package, each loaded from its module when it is first used.
from .arguments import (
    ensure_one_of as ensure_one_of,
    ensure_path as ensure_path,
    ensure_positive as ensure_positive,
    ensure_report as ensure_report,
    ensure_type as ensure_type,
    ensure_whole as ensure_whole,
)
from .covariances import (
    MOST_NAMES as MOST_NAMES,
    NamedMatrix as NamedMatrix,
    half_digit as half_digit,
    matrix_problems as matrix_problems,
)
from .decoding import (
    LINE_END as LINE_END,
    decoded as decoded,
    refuse_controls as refuse_controls,
    text_and_encoding as text_and_encoding,
)
from .extensions import (
    MissingExtensionError as MissingExtensionError,
    UnusableError as UnusableError,
    optional_service as optional_service,
    provided as provided,
    provider as provider,
    service as service,
    shipped as shipped,
)
from .messages import (
    MORE_ERRORS as MORE_ERRORS,
    MOST_MESSAGES as MOST_MESSAGES,
    ExperimentError as ExperimentError,
    Message as Message,
    Step as Step,
    Steps as Steps,
    format_path as format_path,
    in_lines as in_lines,
    in_one_line as in_one_line,
    refused as refused,
)
from .module_finder import own_modules as own_modules
from .number_arrays import Array as Array, Flags as Flags, Indices as Indices, Integers as Integers
from .own_code import (
    OwnCodeError as OwnCodeError,
    error_text as error_text,
    own_array as own_array,
    own_frame as own_frame,
    own_result as own_result,
    running_own_code as running_own_code,
)
from .problems import (
    Problems as Problems,
    in_order as in_order,
    written_count as written_count,
    written_text as written_text,
)
from .quantities import (
    PARSERS as PARSERS,
    QUANTITY as QUANTITY,
    SMALLEST as SMALLEST,
    LengthFunction as LengthFunction,
    QuantityError as QuantityError,
    Target as Target,
    exact_number as exact_number,
    metres_or_radians as metres_or_radians,
    parse_angle as parse_angle,
    parse_duration as parse_duration,
    parse_length as parse_length,
    parse_length_function as parse_length_function,
    parse_positive_angle as parse_positive_angle,
    parse_positive_length as parse_positive_length,
    parse_positive_temperature_difference as parse_positive_temperature_difference,
    parse_ratio as parse_ratio,
    with_quantities as with_quantities,
)
from .quantity_types import (
    Angle as Angle,
    Bending as Bending,
    CommonPart as CommonPart,
    Day as Day,
    Duration as Duration,
    Expansion as Expansion,
    Length as Length,
    LengthDrift as LengthDrift,
    Place as Place,
    PositiveAngle as PositiveAngle,
    PositiveLength as PositiveLength,
    PositiveTemperatureDifference as PositiveTemperatureDifference,
    Ratio as Ratio,
    RatioDrift as RatioDrift,
    RoomPart as RoomPart,
    Temperature as Temperature,
    TemperatureDifference as TemperatureDifference,
    parse_day as parse_day,
    place_text as place_text,
    stated_day as stated_day,
)
from .settings import (
    Forms as Forms,
    NonEmpty as NonEmpty,
    Settings as Settings,
    Text as Text,
    describe as describe,
    hint as hint,
    listed as listed,
    listing as listing,
    nearest as nearest,
    number_of as number_of,
    shorten as shorten,
)
from .tables import (
    MOST_COLUMNS as MOST_COLUMNS,
    MOST_ROWS as MOST_ROWS,
    FileRow as FileRow,
    header_cells as header_cells,
    header_names as header_names,
    header_texts as header_texts,
    read_table as read_table,
    table_lines as table_lines,
)
from .trust import OPENED as OPENED, UNKNOWN as UNKNOWN, Trust as Trust
from .units import (
    ANGLE_UNITS as ANGLE_UNITS,
    DURATION_UNITS as DURATION_UNITS,
    KINDS as KINDS,
    LENGTH_UNITS as LENGTH_UNITS,
    Units as Units,
    format_angle as format_angle,
    format_duration as format_duration,
    format_length as format_length,
    length_text as length_text,
    plain_unit as plain_unit,
    typed_length as typed_length,
)
from .validation import validated as validated
from .writing import (
    CsvWriter as CsvWriter,
    cell_of_text as cell_of_text,
    text_of_cell as text_of_cell,
    yaml_text as yaml_text,
)
from .yamltree import (
    LOADER as LOADER,
    GivenText as GivenText,
    Mapping as Mapping,
    Mark as Mark,
    Node as Node,
    Scalar as Scalar,
    Sequence as Sequence,
    child as child,
    mark_of as mark_of,
    parse_tree as parse_tree,
    read_bytes as read_bytes,
    read_text as read_text,
    read_tree as read_tree,
    to_list as to_list,
    to_python as to_python,
    utf8_text as utf8_text,
    walk as walk,
    written as written,
)
