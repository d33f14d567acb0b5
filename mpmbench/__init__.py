"""mpmbench: particle methods of solid mechanics on the same problem, the same particles and the same norm."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpmbench.results.campaign import open_campaign

__version__ = "0.1.0"
__all__ = ["__version__", "open_campaign"]


def __getattr__(name: str) -> Any:
    """Import `open_campaign` only when it is asked for: the command line must start without xarray."""
    if name == "open_campaign":
        from mpmbench.results.campaign import open_campaign

        return open_campaign
    raise AttributeError(f"module 'mpmbench' has no attribute '{name}'")
