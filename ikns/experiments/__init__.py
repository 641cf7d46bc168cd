"""Experiments with people or virtual participants, from schedule to summary."""
