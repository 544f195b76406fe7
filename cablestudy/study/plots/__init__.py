"""Pictures: the static form, the deflection by point loads, mode shapes, a study. The only importer of matplotlib.

`style` has the look and the axes, then one file for each idea: `form`, `deflection`, `modes`, `study`,
`wind`, `bode`, `trade`.
"""

from cablestudy.study.plots.bode import bode
from cablestudy.study.plots.form import static_form
from cablestudy.study.plots.modes import mode_shapes
from cablestudy.study.plots.study import study_plot
from cablestudy.study.plots.style import save
from cablestudy.study.plots.trade import trade_plot
from cablestudy.study.plots.wind import wind_response

__all__ = ["bode", "mode_shapes", "save", "static_form", "study_plot", "trade_plot", "wind_response"]
