"""Compiled kernels: plain arrays in and out, one file a kernel, each with its formula.

What calls them checks its input; a kernel does not. None keeps anything between calls:
scratch memory comes in as an argument, so threads do not meet.
"""
