"""The loop by hand, on a local page: compare, see what is missing, switch it on, write it down.

In: a study. Out: a page on the loopback address, under a token, that writes nothing but effects
into that study, and these on a click only.

- `switched_fit`: the model with the effects that are switched on, fitted and judged at once.
- `effect_choices`: what a diagnosis offers to switch on; `search_thread` runs it meanwhile.
- `opened_study`: a study as it was read, and written to while it is still that.
"""
