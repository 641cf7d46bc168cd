"""Parts of ``live_loop.py``."""
