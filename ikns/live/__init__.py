"""Live control: streams of markers, the control loop, sessions, calibration."""
