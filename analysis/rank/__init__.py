"""What a design leaves undetermined, and in which words."""
