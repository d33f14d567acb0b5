"""``python -m mpmbench``."""

import os
import sys


def is_here(place: str) -> bool:
    """Whether a folder is the current one."""
    try:
        return os.path.samefile(place or os.curdir, os.curdir)
    except OSError:  # it has been removed
        return not place


# Python looks here for modules first. What happens to lie in the current folder must not be run,
# unless it is this package itself.
ours = os.path.join(sys.path[0], "mpmbench", "__main__.py")
if not sys.flags.safe_path and is_here(sys.path[0]) and not os.path.isfile(ours):
    del sys.path[0]

from mpmbench.cli import main

sys.exit(main())
