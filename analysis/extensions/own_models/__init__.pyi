# Public names of this package, each loaded from its module when it is first used.
from .custom import module_source as module_source
from .python_model import PythonSettings as PythonSettings
from .python_values import PythonCalibration as PythonCalibration
