"""What every compiled kernel shares: the decorator, dispatch on the type of a small tuple, and small arrays on the stack.

The number of dimensions reaches a kernel as the length of a tuple, which numba knows when it compiles: loops over it
unroll, and one text serves 1D, 2D and 3D.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, njit, types
from numba.core import cgutils
from numba.extending import intrinsic, overload

# "contract" permits fused multiply-add; nothing that reorders sums, so that a result does not depend on unrolling.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "cache": True, "nogil": True}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function to machine code in float64, cached on disk."""
    return njit(**OPTIONS)(function)


def implements(stub: Callable[..., Any], handle: type) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a function as the version of `stub` for handles (NamedTuples) of the given class.

    A kernel that calls `stub(handle, ...)` is compiled once per handle class and reaches the disk cache, which a
    function passed as an argument never does.
    """

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        def choose(first, *rest):  # type: ignore[no-untyped-def]
            return function if getattr(first, "instance_class", None) is handle else None

        overload(stub, jit_options={"error_model": "numpy", "fastmath": {"contract"}}, strict=False)(choose)
        return function

    return decorate


@intrinsic
def _stack(typingctx, like):  # type: ignore[no-untyped-def]
    """Pointer to as many float64 on the stack as the tuple `like` is long."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        element = context.get_data_type(types.float64)
        block = cgutils.alloca_once(builder, ir.ArrayType(element, like.count))
        return builder.bitcast(block, element.as_pointer())

    return types.CPointer(types.float64)(like), generate


def vector(axes: tuple[Any, ...]) -> np.ndarray:
    """Uninitialised float64 array as long as the tuple, on the stack (in kernels)."""
    return np.empty(len(axes))


def matrix(rows: tuple[Any, ...], columns: tuple[Any, ...]) -> np.ndarray:
    """Uninitialised float64 array of ``len(rows) x len(columns)``, on the stack (in kernels)."""
    return np.empty((len(rows), len(columns)))


@overload(vector)
def _vector(axes):  # type: ignore[no-untyped-def]
    n = len(axes)
    return lambda axes: carray(_stack(axes), (n,))


@overload(matrix)
def _matrix(rows, columns):  # type: ignore[no-untyped-def]
    n, m = len(rows), len(columns)
    block = (0.0,) * (n * m)
    return lambda rows, columns: carray(_stack(block), (n, m))
