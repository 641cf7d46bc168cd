"""Virtual subjects: simulated people with a known truth."""
