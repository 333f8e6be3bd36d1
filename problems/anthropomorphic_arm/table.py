"""The arm of ten joints: four estimates inside a computed torque.

python problems/anthropomorphic_arm/table.py
python problems/anthropomorphic_arm/table.py --samples 50000
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

from tracking import main  # noqa: E402

if __name__ == "__main__":
    main(HERE, __doc__)
