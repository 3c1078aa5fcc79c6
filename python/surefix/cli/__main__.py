"""``python -m surefix.cli``."""

import sys

from surefix.cli import main

if __name__ == "__main__":
    sys.exit(main())
