"""The command line: a thin shell over the package's public names."""

from ikns.cli.app import main

__all__ = ["main"]
