"""The command `python -m mplicits`."""

import sys

from .cli import main

sys.exit(main())
