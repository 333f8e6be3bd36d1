"""What an installation without a clone has: all that the commands need is in the wheel."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_embedded_example_is_in_the_wheel(tmp_path: Path) -> None:
    """Laid out as the wheel lays it out; `pip install .` and `dynident demo` is how many begin."""
    said = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = said["tool"]["hatch"]["build"]["targets"]["wheel"]
    skipped = shutil.ignore_patterns("__pycache__")
    for source in wheel["packages"]:
        shutil.copytree(ROOT / source, tmp_path / Path(source).name, ignore=skipped)
    for source, target in wheel.get("force-include", {}).items():
        shutil.copytree(ROOT / source, tmp_path / target)
    # Alone: the clone is not on the path, and no folder beside it has problems.
    code = "from dynident.cli.demonstration import _demo_study; print(_demo_study())"
    done = subprocess.run(
        [sys.executable, "-P", "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {code}"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    study = Path(done.stdout.strip())
    assert done.returncode == 0 and study.is_relative_to(tmp_path), done.stderr
    for one in tomllib.loads(study.read_text(encoding="utf-8"))["recordings"]:
        assert (study.parent / one["file"]).is_file()
