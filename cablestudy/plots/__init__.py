"""Pictures, each in a file of its own; `style` has the common look. Only this package imports matplotlib."""

from cablestudy.plots.form import case_forms as case_forms
from cablestudy.plots.form import load_path as load_path
from cablestudy.plots.form import static_form as static_form
from cablestudy.plots.loop import bode as bode
from cablestudy.plots.loop import loop_in_time as loop_in_time
from cablestudy.plots.loop import loop_margins as loop_margins
from cablestudy.plots.modes import coupled_mode_shapes as coupled_mode_shapes
from cablestudy.plots.modes import mode_shapes as mode_shapes
from cablestudy.plots.modes import save_animation as save_animation
from cablestudy.plots.study import not_drawn as not_drawn
from cablestudy.plots.study import sensitivity_plot as sensitivity_plot
from cablestudy.plots.study import study_plot as study_plot
from cablestudy.plots.style import name_case as name_case
from cablestudy.plots.style import save as save
from cablestudy.plots.trade import trade_plot as trade_plot
from cablestudy.plots.wind import wind_response as wind_response
