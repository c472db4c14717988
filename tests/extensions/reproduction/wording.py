"""The wording that the tests of reproduction expect: a rewording is entered here alone."""

NOT_EVERYTHING_COMPARED_AGREES = "NOT everything compared agrees"
NO_EXPERIMENT_DID_YOU_MEAN = 'no experiment "6.2.9"; did you mean'
NO_SUCH_FOLDER = "no such folder; name that of the shipped designs"
