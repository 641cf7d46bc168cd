"""What `paper_statistics.py` is made of."""
