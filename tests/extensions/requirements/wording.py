"""The wording that the tests of requirements expect: a rewording is entered here alone."""

FROM_MM_MM = "from 1010 mm x 1010 mm on, the file is invalid: positions[0]: reading ball"
THE_FILE_HAS_NO_TASKS = "the file has no tasks"
THE_FILE_IS_INVALID = "the file is invalid with 2 x 2, 3 x 2"
UNKNOWN_ARTEFACT_DID_YOU_MEAN = 'unknown artefact "plat"; did you mean "plate"?'
LIMITED_BY_TEMPERATURES = "limited most by: standard uncertainty of temperatures"
NO_SIZE_DETERMINES = "with every value from 37.5 mm x 37.5 mm to 1000 mm x 1000 mm"
