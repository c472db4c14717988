"""What an influence quantity has to be: its settings, its parameters and its effect on readings."""
