"""Criteria for tests that are not about the search through all shapes, of which most is left out.

That it finds nothing in physics that no catalogue has, with all of its generations, is tested with
`test_an_effect_outside_the_catalogue_is_called_unknown`.
"""

from __future__ import annotations

from dynident.criteria import Criteria

BRIEF = Criteria.with_values({"global_search": {"population": 2, "generations": 1}})
