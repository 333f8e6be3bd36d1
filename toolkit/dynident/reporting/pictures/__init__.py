"""Pictures. In: a diagnosis, a validation, a history of iterations, robots. Out: figures.

Two media, one library for each. The page of the report is interactive and drawn with plotly
(`diagnosis_pictures`, `reporting.loop_page`). What must stand still (committed notebooks, which
code hosts show without running them; `--plot`; papers) is drawn with matplotlib (`plots`,
`loop_plots`, `convergence`, `ellipsoids`), because a still of a plotly figure takes a browser. What
both media show of a diagnosis or a loop is worked out once, in `reporting.content` and
`reporting.loop_content`.
"""
