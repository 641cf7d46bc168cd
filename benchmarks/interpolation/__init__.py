"""What `interpolation_error.py` is made of."""
