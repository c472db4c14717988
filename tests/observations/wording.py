"""The wording that the tests of observations expect: a rewording is entered here alone."""

IS_CODE_IN_PYTHON = "object: is code in Python"
LENGTHS_ARE_READ_AS_INDEPENDENT = "lengths are read as independent"
NO_RESULT_IS_CALLED = 'no result is called "Later"; it has "Before"'
RESULTS_HAVE_THESE_VALUES = (
    '2 results have these values: "Before" (id b, refType x_before), "After"'
)
SAY_WHICH_WITH_RESULT = "choose one with result:"
