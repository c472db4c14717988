# Public names of this package, each loaded from its module when it is first used.
from .joining import joined as joined
from .observed_readings import ObservedReadings as ObservedReadings, observe as observe
from .reading_files import read_readings as read_readings
from .reading_sources import (
    Source as Source,
    SourceRows as SourceRows,
    SourceText as SourceText,
    Units as Units,
    fingerprint as fingerprint,
    is_plain as is_plain,
    named_rows as named_rows,
    plain_rows as plain_rows,
    position_fingerprints as position_fingerprints,
)
from .simulated import (
    HasRandomPart as HasRandomPart,
    NoReadingError as NoReadingError,
    Simulated as Simulated,
    exact_readings as exact_readings,
    noisy_readings as noisy_readings,
    on_stated_machine as on_stated_machine,
    scale_readings as scale_readings,
    simulated_readings as simulated_readings,
    too_large as too_large,
)
from .true_artefacts import noisy_certificate as noisy_certificate
