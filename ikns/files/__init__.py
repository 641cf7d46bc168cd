"""Marker files: C3D, TRC and Vicon Nexus CSV."""
