"""Reaches to measure a control signal on: simulated ones, and those of real people."""
