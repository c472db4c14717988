"""Random changes of meaning in the code, and whether the tests notice them."""
