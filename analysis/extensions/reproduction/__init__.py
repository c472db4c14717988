"""Published experiments: the values that documents print, compared with the shipped designs."""
