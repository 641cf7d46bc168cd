"""Live: markers stream in, a signal drives the finger, and a session is kept."""
