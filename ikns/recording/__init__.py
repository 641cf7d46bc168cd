"""Recordings: markers over time, and the files that hold them."""
