"""Run the blind study: python benchmarks/blind_study --help"""

import sys
from pathlib import Path

# Run as a folder, its own modules would be found by bare names: they are those of a package.
sys.path[0] = str(Path(__file__).resolve().parents[1])

from blind_study.command import main  # noqa: E402

if __name__ == "__main__":
    main()
