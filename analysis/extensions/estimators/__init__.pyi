# Public names of this package, each loaded from its module when it is first used.
from .distances import compare_estimators as compare_estimators
