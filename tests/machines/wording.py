"""The wording that the tests of machines expect: a rewording is entered here alone."""

DID_YOU_MEAN = 'did you mean "straight"?'
FOR_AN_OBJECT_OF_A_MODULE = "for an object of a module write module:name"
NO_ENTRY_POINT = 'no entry point "straigth"'
UNKNOWN_PARAMETER_DID_YOU_MEAN = 'unknown parameter "squarness xz"; did you mean "squareness xz"?'
