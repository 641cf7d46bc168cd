"""Parts of ``benchmarks/endings.py``: how programs are started, ended and judged."""
