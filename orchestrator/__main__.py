"""`python -m orchestrator` is `nlosim`."""

import sys

from orchestrator.cli import main

sys.exit(main())
