# Public names of this package, each loaded from its module when it is first used.
from .displacements import SharedDisplacements as SharedDisplacements
from .drift import Drift as Drift, even_clock as even_clock
from .sag import Sag as Sag, SagSettings as SagSettings
from .temperature import TemperaturesSettings as TemperaturesSettings
