"""dynident: robot model identification that tells you what physics your model lacks.

import dynident as di

study = di.load("problems/emps/study.toml")
fit = di.fit(study.model, study.train)
di.compare(fit, study.test).show()
d = di.diagnose(fit, study.train, study.test)
d.show()
better = di.fit(study.model + d.best.effect, study.train)
di.compare({"before": fit, "after": better}, study.test).show()
di.report(d, to="report.html")

The names here are those that most studies need; the rest is one level down, in the room that it
belongs to: `di.closed_loop` (simulation, virtual experiments), `di.constraints` (sets of robots),
`di.effects` (the catalogue), `di.fitting` (estimators), `di.regression` (noise in the inputs).
Everything is imported when it is first asked for, so that `import dynident` costs nothing; the
file `__init__.pyi` beside this one says where each name lives.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
