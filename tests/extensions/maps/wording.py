"""The wording that the tests of maps expect: a rewording is entered here alone."""

AS_ALIKE_AS_THESE = "as alike as these"
A_MACHINE_FILE_STATES_ITS_OWN = "a machine file states its own probe"
BOTH_REST_ON_SOME = "both rest on some of the same readings"
BY_THE_EXPANDED_UNCERTAINTY = "by the expanded uncertainty 1.5 u of"
CARRIES_CARRIES_THE_PROBE = (
    "FB1: x carries z carries the probe, y carries the workpiece; errors are the tip's position"
)
CHANGE_NONE_OF_THESE_LENGTHS = (
    "leave these lengths unchanged, but may change those of another --grid"
)
DEGREES_OF_FREEDOM_IS_ITSELF_UNCERTAIN = "degrees of freedom is itself uncertain by"
DOES_NOT_HOLD_WHAT_CERTIFICATES_DO = "does not hold what certificates do"
GIVE_A_FIT_WHAT = "give a fit, what its to_map"
IS_NO_MAP_FILE = "is no map file"
LENGTHS_ARE_UNDETERMINED_AND_MEET = "lengths are undetermined and meet no target, such as ("
LENGTHS_BETWEEN_POINTS = "153 lengths between 18 points of a grid, with the probe down"
MET_BY_THE_STANDARD_UNCERTAINTY = "met by the standard uncertainty u of"
NO_CERTIFIED_VALUE_IN_COMMON = "no certified value in common"
NO_CHANGE_IS_SHOWN = "no change is shown"
OF_POINTS_LIE_OUTSIDE_THE_VOLUME = "1 of 3 points lie outside the volume of the map"
PUTS_THE_SCALES = "moves the scales to"
READINGS_ARE_OUTSIDE_THE_MEASURING_VOLUME = (
    "warning: 9 readings are outside the measuring volume, and the error model is "
    "extrapolated there; furthest is ball r3c3 in position flat with probe long, at z = "
    "1050 mm, 50 mm above it (line 10); correct machine.volume, or the readings"
)
READINGS_ARE_THE_SAME_IN_BOTH = "warning: readings are the same in both campaigns in 6 p"
READINGS_IN_COMMON_MAY_HIDE = "readings in common may hide a change"
REST_ON_THE_SAME_READINGS = "rest on the same readings"
THE_CAMPAIGNS_ARE_TAKEN = "the campaigns are taken to be independent"
THE_SAME_IN_BOTH_CAMPAIGNS = "the same in both campaigns in x low:"
THIS_DESCRIBES_A = "this describes a machine; use it with ballplate map"
THIS_IS_AN_EXPERIMENT = "this is an experiment or a sweep; name a machine file"
THIS_IS_A_MAP = "this is the error map of a fit"
TILT_OF_THE_COLUMN = "tilt of the column by the arm, over the whole axis"
UNDETERMINED_WHAT_THESE_CHANGE = "undetermined; what these change is not stated"
