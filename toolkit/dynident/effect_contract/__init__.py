"""What every effect promises, put to the test: `check_effect` for one's own as for the catalogue's.

In: a class. Out: nothing, or the first rule that it breaks, with figures. An effect is tried at
every place of a small crane (`crane`), whose joints slide and turn.
"""

from dynident.effect_contract.check_effect import RULES, check_effect

__all__ = ["RULES", "check_effect"]
