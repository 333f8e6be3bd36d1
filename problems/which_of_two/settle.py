"""From recordings that leave three pairs of effects open to the recording that settles them.

    python problems/which_of_two/settle.py OUT

Diagnoses the small motions, designs the recording that tells apart what they leave open, has the
arm follow it as it truly is, diagnoses again, and writes the recording to the folder OUT.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import dynident as di
from dynident.closed_loop import load_experiment
from dynident.experiment_design import DesignTask
from dynident.experiment_design.virtual_recording import ClosedDesignLoop, close_design_loop
from dynident.recording import write

HERE = Path(__file__).resolve().parent
TASK = DesignTask(starts=1)
"""As `dynident explain --design` has it: 10 s, three times."""


def settled() -> ClosedDesignLoop:
    """Close the loop on the recordings of this folder."""
    study = di.load(HERE / "study.toml")
    truth = load_experiment(HERE / "experiment.toml")
    return close_design_loop(study.model, study.train, truth, TASK)


def main() -> None:
    """Print what was open, what was designed for it, and what is settled."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("out", type=Path, help="folder, for designed.npz")
    out = parser.parse_args().out
    loop = settled()
    out.mkdir(parents=True, exist_ok=True)
    write(loop.recording, out / "designed.npz")
    loop.show()


if __name__ == "__main__":
    main()
