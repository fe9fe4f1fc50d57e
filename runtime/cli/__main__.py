"""`python -m runtime.cli` is the `bunraku` command."""

import sys

from runtime.cli.command_line import main

sys.exit(main())
