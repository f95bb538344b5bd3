"""``python -m graspforce``."""

import sys

from graspforce.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
