"""Text files, numbers with units, and messages about errors in files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .arguments import (
        ensure_one_of,
        ensure_path,
        ensure_positive,
        ensure_report,
        ensure_type,
        ensure_whole,
    )
    from .covariances import (
        MOST_NAMES,
        NamedMatrix,
        half_digit,
        matrix_problems,
    )
    from .days import Day, parse_day, stated_day
    from .decoding import LINE_END, decoded, refuse_controls, text_and_encoding
    from .extensions import MissingExtensionError, optional_service, provider, service, shipped
    from .faces import lazily as lazily
    from .messages import (
        MORE_ERRORS,
        MOST_MESSAGES,
        ExperimentError,
        Message,
        Step,
        Steps,
        format_path,
        in_lines,
        in_one_line,
        refused,
    )
    from .module_finder import own_modules
    from .number_arrays import Array, Flags, Integers
    from .own_code import (
        OwnCodeError,
        error_text,
        own_array,
        own_frame,
        own_result,
        running_own_code,
    )
    from .problems import Problems, in_order, written_count, written_text
    from .quantities import (
        PARSERS,
        QUANTITY,
        SMALLEST,
        LengthFunction,
        QuantityError,
        Target,
        exact_number,
        metres_or_radians,
        parse_angle,
        parse_duration,
        parse_length,
        parse_length_function,
        parse_positive_angle,
        parse_positive_length,
        parse_positive_temperature_difference,
        parse_ratio,
        with_quantities,
    )
    from .quantity_types import (
        Angle,
        Bending,
        CommonPart,
        Duration,
        Expansion,
        Length,
        LengthDrift,
        PositiveAngle,
        PositiveLength,
        PositiveTemperatureDifference,
        Ratio,
        RatioDrift,
        Temperature,
        TemperatureDifference,
    )
    from .quantity_words import (
        format_angle,
        format_duration,
        format_length,
        length_text,
        typed_length,
    )
    from .room_parts import Place, RoomPart, length_of, place_text
    from .settings import (
        Forms,
        NonEmpty,
        Settings,
        Text,
        describe,
        hint,
        listed,
        listing,
        nearest,
        number_of,
        shorten,
    )
    from .spreadsheets import CsvWriter, cell_of_text, text_of_cell
    from .tables import (
        MOST_COLUMNS,
        MOST_ROWS,
        FileRow,
        header_cells,
        header_names,
        header_texts,
        read_table,
        table_lines,
    )
    from .trust import OPENED, UNKNOWN, Trust
    from .units import ANGLE_UNITS, DURATION_UNITS, KINDS, LENGTH_UNITS, Units, plain_unit
    from .unusable import UnusableError
    from .validation import validated
    from .yaml_writing import yaml_text
    from .yamltree import (
        LOADER,
        GivenText,
        Mapping,
        Mark,
        Node,
        Scalar,
        Sequence,
        child,
        mark_of,
        parse_tree,
        read_bytes,
        read_text,
        read_tree,
        to_list,
        to_python,
        utf8_text,
        walk,
        written,
    )

__getattr__, __dir__ = lazily(__name__, __file__)
