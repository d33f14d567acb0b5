"""What every compiled kernel shares: decorators, dispatch on the type of a small tuple, small arrays on the stack.

The number of dimensions reaches a kernel as the length of a tuple, which numba knows when it
compiles: loops over it unroll, and one text serves 1D, 2D and 3D.
"""

import importlib
import sys
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import jit, njit, types
from numba.core import cgutils
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array, populate_array

# With its first kernel numba looks for BLAS, which no kernel of ours calls, and so loads a tenth of a
# second of scipy in every run. Without it kernels lack `np.cov`, and nothing else.
_hidden = sys.modules.setdefault("scipy.linalg", None)  # type: ignore[arg-type]
importlib.import_module("numba.np.arraymath")
if _hidden is None:
    del sys.modules["scipy.linalg"]

# "contract" permits fused multiply-add; nothing that reorders sums, so that a result does not
# depend on unrolling.
OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "fastmath": {"contract"},
    "cache": True,
    "nogil": True,
    "no_cfunc_wrapper": True,
}
# Only kernels call what is inlined: wrappers for Python and C would be a sixth of all compiling.
INLINED: Any = {key: OPTIONS[key] for key in ("error_model", "fastmath", "cache")} | {
    "_nrt": False,
    "forceinline": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a function to machine code in float64, cached on disk."""
    return njit(**OPTIONS)(function)


kernel = compiled  # the name that plug-ins of version 0.1 use


def lean(function: Callable[..., Any]) -> Any:
    """Compile a function without reference counts, for loops in which counting would cost more than the arithmetic.

    numba counts references whenever an array is taken out of a tuple. A `lean` kernel leaves that
    out and therefore cannot allocate: its arrays come from outside, or from the stack.
    """
    return njit(**(OPTIONS | {"_nrt": False}))(function)


class ForKernels(CPUDispatcher):
    """A function without wrappers, which numba would jump to at no address when Python calls it."""

    def __call__(self, *arguments: Any) -> Any:
        """Compile it once more for Python, which calls it in tests, if at all."""
        if "whole" not in self.__dict__:
            self.whole = jit(**self.targetoptions | {"no_cpython_wrapper": False})(self.py_func)
        return self.whole(*arguments)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a small helper of `lean` kernels into its callers."""
    return _for_kernels(function, INLINED)


def _for_kernels(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    dispatcher = njit(**(OPTIONS | options))(function)
    dispatcher.__class__ = ForKernels
    return dispatcher


def summing(function: Callable[..., Any]) -> Any:
    """An `inlined` helper whose sums the compiler may take in an order of its own: several at once.

    The order is fixed when it compiles, so that a result does not depend on threads; but two
    processors need not agree to the last bit.
    """
    return _for_kernels(function, INLINED | {"fastmath": {"contract", "reassoc"}})


_versions: set[tuple[str, type]] = set()
_fallbacks: dict[str, list[Callable[..., Any] | None]] = {}


def implemented(stub: Callable[..., Any], handle: type) -> bool:
    """Whether some file implements `stub` for handles of this very class."""
    return (stub.__name__, handle) in _versions


def has_version(stub: Callable[..., Any], handle: type) -> bool:
    """Whether some file implements `stub` for handles of this class, or something that it follows from."""
    return implemented(stub, handle) or any(
        given is None or has_version(given, handle) for given in _fallbacks.get(stub.__name__, [])
    )


def implements(
    stub: Callable[..., Any], handle: type
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a function as the version of `stub` for handles (NamedTuples) of the given class.

    A kernel that calls `stub(handle, ...)` is compiled once per handle class and reaches the disk
    cache, which a function passed as an argument never does. The function cannot allocate (see
    `lean`).
    """

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        def choose(first, *rest):
            return function if getattr(first, "instance_class", None) is handle else None

        overload(stub, jit_options=INLINED, strict=False)(choose)
        _versions.add((stub.__name__, handle))
        return function

    return decorate


def fallback(
    stub: Callable[..., Any],
    given: Callable[..., Any] | None = None,
    unless: Callable[..., Any] | None = None,
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a function as the version of `stub` for handles that have none of their own.

    With `given`, another stub, it serves the handles that have a version of that, before a version
    without `given` does; with `unless`, those that have none of that one.
    """

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        def choose(first, *rest):
            handle = getattr(first, "instance_class", None)
            if handle is None or implemented(stub, handle):
                return None
            if unless is not None and has_version(unless, handle):
                return None
            if given is not None:
                return function if has_version(given, handle) else None
            others = (one for one in _fallbacks[stub.__name__] if one is not None)
            return None if any(has_version(one, handle) for one in others) else function

        overload(stub, jit_options=INLINED, strict=False)(choose)
        _fallbacks.setdefault(stub.__name__, []).append(given)
        return function

    return decorate


def answers_by_default(stub: Callable[..., Any]) -> Any:
    """Decorate a stub whose own body is the version for handles that have none of their own."""
    return fallback(stub)(stub)


generated: Any = intrinsic


def _stack_array(context, builder, array, shape):
    """Uninitialised float64 array on the stack."""
    length = 1
    for n in shape:
        length *= n
    data = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), length))
    data.align = 64  # a cache line, and the longest vector
    strides = [8 * shape[1], 8] if len(shape) == 2 else [8]
    value = make_array(array)(context, builder)
    populate_array(
        value,
        data=builder.bitcast(data, ir.DoubleType().as_pointer()),
        shape=[context.get_constant(types.intp, n) for n in shape],
        strides=[context.get_constant(types.intp, n) for n in strides],
        itemsize=context.get_constant(types.intp, 8),
        meminfo=None,
    )
    return value._getvalue()


@generated
def vector(typingctx, axes):
    """Uninitialised float64 array as long as the tuple, on the stack."""
    array = types.Array(types.float64, 1, "C")

    def generate(context, builder, signature, arguments):
        return _stack_array(context, builder, array, [axes.count])

    return array(axes), generate


@generated
def matrix(typingctx, rows, columns):
    """Uninitialised float64 array of ``len(rows) x len(columns)``, on the stack."""
    array = types.Array(types.float64, 2, "C")

    def generate(context, builder, signature, arguments):
        return _stack_array(context, builder, array, [rows.count, columns.count])

    return array(rows, columns), generate


@generated
def table(typingctx, first, second, columns):
    """Uninitialised float64 array of ``len(first) len(second) x len(columns)``, on the stack."""
    array = types.Array(types.float64, 2, "C")

    def generate(context, builder, signature, arguments):
        return _stack_array(context, builder, array, [first.count * second.count, columns.count])

    return array(first, second, columns), generate
