"""Experiments with a person in front of the cameras, step by step."""
