"""Compilation of kernels: numba, cached on disk, without the GIL.

`cache_folder` says where machine code is kept, `machine_code` has the files, `linking`
the calls between kernels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numba
from numba.core.types import unliteral

from ikns._kernels.cache_folder import cache_folder, version
from ikns._kernels.linking import call_by_name, compiler
from ikns._kernels.machine_code import KernelCache

_PACKAGE = "ikns._kernels."
_COMPILER = compiler(lambda module: version(module.removeprefix(_PACKAGE)))


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function on its first call; division by zero gives inf or NaN.

    A function whose name begins with an underscore is called by kernels only, as are
    those of :func:`inner`.
    """
    return _compiled(function, wrapped=not function.__name__.startswith("_"))


def inner(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of which other kernel files make use, and Python never does.

    It gets no wrapper for Python, which would unpack tuples of many arrays.
    """
    return _compiled(function, wrapped=False)


def borrowing(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that makes no array and returns none.

    Numba counts the references to each array of each tuple that is passed on, which
    took an eighth of a frame. Such a function only borrows them and does not count.
    """
    wrapped = not function.__name__.startswith("_")
    return _compiled(function, wrapped=wrapped, counting=False)


def inner_borrowing(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that is both :func:`inner` and :func:`borrowing`."""
    return _compiled(function, wrapped=False, counting=False)


def _compiled(
    function: Callable[..., Any], *, wrapped: bool, counting: bool = True
) -> Callable[..., Any]:
    folder = cache_folder(function.__module__.removeprefix(_PACKAGE))
    options: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "no_cpython_wrapper": not wrapped,
        "no_cfunc_wrapper": True,
        "_nrt": counting,
        "pipeline_class": _COMPILER,
    }
    kernel: Any = numba.njit(**options)(function)
    call_by_name(kernel)
    _take_constants_as_values(kernel)
    if folder is not None:
        # As `cache=True` does, with numba's own cache.
        kernel._cache = KernelCache(function, folder)
    return cast("Callable[..., Any]", kernel)


def _take_constants_as_values(kernel: Any) -> None:
    """Do not compile a kernel anew for each constant that another kernel passes to it.

    Numba takes ``f(x, True)`` in compiled code for a type of argument of its own. The
    whole solver was compiled twice so, a sixth of all the time.
    """
    template = kernel.get_call_template

    def of_values(args: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        values = tuple(unliteral(argument) for argument in args)
        named = {name: unliteral(argument) for name, argument in keywords.items()}
        return template(values, named)

    kernel.get_call_template = of_values
