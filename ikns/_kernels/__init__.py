"""Compiled kernels: plain arrays in and out, one file a kernel, each with its formula.

Callers check the input; a kernel does not. None keeps state between calls: scratch
memory is an argument, so threads do not share any.
"""
