"""Pictures, each in a file of its own; `style` has the common look. Only this package imports matplotlib."""

from cablestudy.study.plots.animation import save_animation
from cablestudy.study.plots.bode import bode
from cablestudy.study.plots.cases import case_forms
from cablestudy.study.plots.form import static_form
from cablestudy.study.plots.indices import sensitivity_plot
from cablestudy.study.plots.load_path import load_path
from cablestudy.study.plots.loop import loop_in_time, loop_margins
from cablestudy.study.plots.modes import mode_shapes
from cablestudy.study.plots.study import not_drawn, study_plot
from cablestudy.study.plots.style import save
from cablestudy.study.plots.suspension import suspension_views
from cablestudy.study.plots.suspension_cases import suspension_case_views
from cablestudy.study.plots.suspension_modes import suspension_modes
from cablestudy.study.plots.trade import trade_plot
from cablestudy.study.plots.wind import wind_response

__all__ = [
    "bode",
    "case_forms",
    "load_path",
    "loop_in_time",
    "loop_margins",
    "mode_shapes",
    "not_drawn",
    "save",
    "save_animation",
    "sensitivity_plot",
    "static_form",
    "study_plot",
    "suspension_case_views",
    "suspension_modes",
    "suspension_views",
    "trade_plot",
    "wind_response",
]
