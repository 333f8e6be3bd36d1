"""For all tests: no test of times, the longest files first, and each leaves the catalogue alone."""

from pathlib import Path

import pytest
from hypothesis import settings

from dynident.effects import known_effects

# What a first example loads takes seconds, and machines differ: a deadline would test both.
settings.register_profile("without deadlines", deadline=None)
settings.load_profile("without deadlines")

HERE = Path(__file__).parent
LONGEST = (
    "problems/test_staubli_tx40.py",
    "notebooks/test_notebooks.py",
    "problems/test_panda.py",
    "fitting/instrumental/test_monte_carlo.py",
    "regression/test_known_noise.py",
    "fitting/instrumental/test_residual_noise.py",
    "diagnosis/nuisances/test_quantisation.py",
    "diagnosis/test_whole_catalogue.py",
    "problems/test_hidden_effects.py",
    "problems/test_tracking.py",
    "diagnosis/test_diagnose.py",
    "fitting/uncertainty/test_input_bias.py",
    "fitting/instrumental/test_expected_bias.py",
    "diagnosis/test_verdict.py",
    "regression/test_estimators.py",
    "nlp/test_chains.py",
    "fitting/uncertainty/test_row_errors.py",
    "diagnosis/dependence/test_explained_shares.py",
    "docs/test_code_on_pages.py",
    "explorer/test_page.py",
    "problems/test_emps.py",
    "docs/test_site.py",
    "fitting/instrumental/test_simulated_loop.py",
    "diagnosis/search/test_withdrawal.py",
    "blind_study/test_mujoco_study.py",
    "wiring/test_wiring_check.py",
    "problems/test_iiwa.py",
    "fitting/uncertainty/test_lack_of_fit.py",
    "wiring/test_wiring_of_problems.py",
)
"""More than ten seconds of CPU time each, the longest first. A file is one processor's work
(`--dist loadfile`), so that what its tests share is made once; a long one begun last would be
waited for."""
assert all((HERE / file).is_file() for file in LONGEST)


def pytest_collection_modifyitems(items):
    place = {HERE / file: i for i, file in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path, len(LONGEST)))


@pytest.fixture(autouse=True)
def catalogue_as_it_was():
    """Effects that a test defines join the catalogue for as long as it runs."""
    with known_effects.unchanged():
        yield
