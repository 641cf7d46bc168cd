"""Calls of kernels by name, as between the object files of a C program.

Numba copies into a function all that it calls, and what that calls in turn, and
optimizes and translates it all once more: that was more than half of all compiling.
Here a kernel has only the names of those that it calls, and each is compiled once.
LLVM's loader finds them in what was loaded before. Only small ones are copied, where a
call would take longer than what they do.
"""

from __future__ import annotations

import gc
import importlib
from collections.abc import Callable
from itertools import islice
from typing import Any

from numba.core.compiler import Compiler

#: LLVM's instructions up to which a kernel is copied. A frame takes up to 4 % longer
#: than with all copied, 5 to 7 % with 100 (benchmarks/README.md, command_line).
_SMALL = 250

#: A kernel by the name of its machine code: its file, its own name, types of arguments.
Called = dict[str, tuple[str, str, tuple[Any, ...]]]
_KNOWN: Called = {}


def compiler(version: Callable[[str], str]) -> type[Compiler]:
    """Return numba's compiler, but with names that are the same in every process.

    Numba counts the functions that a process compiles, and the number is part of the
    name of their machine code. Here `version` of their file is.
    """

    class KernelCompiler(Compiler):
        def compile_extra(self, func: Callable[..., Any]) -> Any:
            # What a compiler makes is not garbage before it is done; searching it took
            # a quarter of the time.
            searching = gc.isenabled()
            gc.disable()
            try:
                return super().compile_extra(func)
            finally:
                if searching:
                    gc.enable()

        def _compile_bytecode(self) -> Any:
            identity = self.state.func_id
            identity.unique_id = version(identity.modname)
            return super()._compile_bytecode()

    return KernelCompiler


def call_by_name(kernel: Any) -> None:
    """Have other kernels call this one by name, unless it is small."""
    template = kernel.get_call_template

    def of_values(args: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        found = template(args, keywords)
        for result in kernel.overloads.values():
            if not _is_small(result):
                called = kernel.__module__, kernel.__name__, result.signature.args
                _KNOWN[result.fndesc.mangled_name] = called
                implementations = kernel.targetctx._defns[result.entry_point]
                for _, implementation in implementations.versions:
                    implementation.libs = ()  # what would be copied
        return found

    kernel.get_call_template = of_values


def _is_small(result: Any) -> bool:
    library = result.library
    module = library._shared_module or library._final_module
    function = module.get_function(result.fndesc.mangled_name)
    instructions = (each for block in function.blocks for each in block.instructions)
    return next(islice(instructions, _SMALL, None), None) is None


def called_by(result: Any) -> Called:
    """Return which kernels a compiled one calls by name."""
    return {
        function.name: _KNOWN[function.name]
        for function in result.library._final_module.functions
        if function.is_declaration and function.name in _KNOWN
    }


def load_called(called: Called, codegen: Any) -> bool:
    """Load or compile what a kernel calls; return whether the loader will find it."""
    for file, name, types in called.values():
        getattr(importlib.import_module(file), name).compile(types)
    return all(codegen._engine.is_symbol_defined(name) for name in called)
