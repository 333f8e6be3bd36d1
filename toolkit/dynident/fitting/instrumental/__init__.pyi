from .estimator import IV as IV
from .measured_instruments import Filtered as Filtered
from .measured_instruments import SwappedPeriods as SwappedPeriods
from .simulated_loop import SimulatedLoop as SimulatedLoop
from .source import Instruments as Instruments
