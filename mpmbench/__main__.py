"""``python -m mpmbench``."""

import sys

from mpmbench.cli import main

sys.exit(main())
